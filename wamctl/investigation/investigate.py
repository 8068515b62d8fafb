"""Rounds until the verdict is final or the budget is used up; results after every round."""

import json
import shlex
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from wamctl.arm.configuration.known_change import WORDS
from wamctl.arm.errors import DataError
from wamctl.investigation.budget import Budget, Cost
from wamctl.investigation.decision import NONE, Decision, decided, ended, known
from wamctl.investigation.evidence import words
from wamctl.investigation.intervention import question
from wamctl.investigation.page import page
from wamctl.investigation.programs import ProgramError
from wamctl.investigation.rounds import BudgetSpentError, Site, next_round, place_of
from wamctl.investigation.state import UNKNOWN, Request, State, begun, keep, write_whole
from wamctl.investigation.weighing import closed_by, read

_NO_MOTION = "ident plan", 6  # that command's exit code where no motion is left


@dataclass(frozen=True)
class Investigation:
    """What came of it.

    Attributes:
        content: of `investigation.json`.
        sentences: for the operator.
    """

    content: dict[str, Any]
    sentences: tuple[str, ...]


def investigate(
    site: Site, request: Request, budget: Budget, resume: bool, answer: str = ""
) -> Investigation:
    """Experiment, identify, ask for the gap, and choose the next motion, until it is final.

    Args:
        site: where it works.
        request: which arm.
        budget: what it may cost.
        resume: go on where an earlier session has ended.
        answer: what the operator has done to the arm since then; empty for nothing.

    Raises:
        UserError: it could not begin or go on; what is done is kept, and --resume goes on.
    """
    state = begun(site.out, request, resume)
    state = replace(state, pending=answer or state.pending)
    clock = _Clock(state.wall_s)
    keep(site.out, state)
    decision = _final(state, budget) if state.rounds else None
    while True:
        if decision is not None:
            answer = _answered(site, state, budget, decision)
            if not answer:
                break
            state = replace(state, pending=answer, wall_s=clock.wall_s())
            keep(site.out, state)
        try:
            item = next_round(_watched(site, state, budget, clock), state)
        except BudgetSpentError as spent:
            decision = ended(state.rounds, spent.reached)
            if state.pending:
                break
            continue
        except ProgramError as error:
            if (error.command, error.exit_code) != _NO_MOTION:
                keep(site.out, replace(state, wall_s=clock.wall_s()))
                raise
            decision = ended(state.rounds, error.said)
            if state.pending:  # not even the changed arm has one
                break
            continue
        except BaseException:
            keep(site.out, replace(state, wall_s=clock.wall_s()))
            raise
        state = State(request, (*state.rounds, item), clock.wall_s())
        keep(site.out, state)
        decision = _final(state, budget)
        _write(site, state, budget, decision)
        site.tell(_said(state))
    content = _write(site, state, budget, decision)
    sentences = (_sentence(content), decision.sentence)
    if content["intervention"]:
        how = f"What would settle it: {content['intervention']}. Then go on with --resume --answer:"
        sentences = (*sentences, f"{how} {WORDS}.")
    return Investigation(content, sentences)


def _watched(site: Site, state: State, budget: Budget, clock: "_Clock") -> Site:
    """The site with an eye on budget and clock; time counts, also should the session be killed."""

    def tell(what: str) -> None:
        keep(site.out, replace(state, wall_s=clock.wall_s()))
        site.tell(what)

    def reached(further: Cost) -> str | None:
        return budget.passed(state.cost.plus(further), clock.wall_s(), 0)

    return replace(site, tell=tell, reached=reached)


class _Clock:
    """Time of all sessions together."""

    def __init__(self, before_s: float, now: Callable[[], float] = time.monotonic) -> None:
        self._before_s, self._now, self._began = before_s, now, now()

    def wall_s(self) -> float:
        """Up to now [s]."""
        return self._before_s + self._now() - self._began


def _answered(site: Site, state: State, budget: Budget, decision: Decision) -> str:
    """What the operator has done to the arm for a further motion; empty: it ends here."""
    plan = _last_plan(site, state)[1]
    asked = question(state, budget, decision, plan.get("intervention"))
    return site.ask(asked) if asked else ""


def _last_plan(site: Site, state: State) -> tuple[Path, dict[str, Any]]:
    """Folder and content of the last plan whose motion came to its end."""
    led = [r for r in state.rounds if r.verdict and r.leader]
    if not led:
        return site.out, {}
    folder = site.out / led[-1].folder / "plan"
    return folder, read(folder / "plan.json")


def _final(state: State, budget: Budget) -> Decision | None:
    left = budget.rounds_left(state.cost, state.wall_s, state.motions, len(state.rounds))
    decision = decided(state.rounds, left)
    if decision is not None:
        return decision
    if state.pending and budget.passed(state.cost, state.wall_s, 0) is None:
        return None
    reached = budget.passed(state.cost, state.wall_s, state.motions)
    return None if reached is None else ended(state.rounds, reached)


def _said(state: State) -> str:
    last = state.rounds[-1]
    if last.stopped is not None:
        return f"a limit has ended the motion: {last.stopped}"
    likely = sorted(last.odds.items(), key=lambda item: -item[1])[:3]
    told = ", ".join(f"{words(name)} {share:.0%}" for name, share in likely)
    link = ", partly" if last.verdict == UNKNOWN else ""
    answer = f"{link} {words(last.answer)}" if last.answer else ""
    return f"{words(last.verdict)}{answer}; odds: {told}"


def _write(site: Site, state: State, budget: Budget, decision: Decision | None) -> dict[str, Any]:
    """Write `investigation.json`, `model.yaml` and `report.html` as they are now."""
    whole = [r for r in state.rounds if r.verdict]
    searched = state.asked_for_gap
    if not searched:
        raise DataError("No motion came to its end, so that there is nothing to say.")
    last = site.out / searched[-1].folder
    gap = read(last / "gap.json")
    planned, plan = _last_plan(site, state)
    named = decision is not None and decision.verdict in ("named", "ambiguous", "unknown")
    measured = plan.get("measured", []) if decision and decision.verdict == "unknown" else []
    if known(whole, UNKNOWN).get(NONE, 0.0) < 0.0:  # a curve that predicts no better is none
        measured = []
    lead = decision.answer if decision and decision.answer else whole[-1].leader
    lead = UNKNOWN if measured else lead
    borne_out = _beside_gap(gap, plan, lead) if named and whole[-1].is_suspicion else []
    if measured:
        weights = site.out / whole[-1].folder / "weights.json"
        closed = {"evidence": {"closed_on_new_motion": closed_by(weights, UNKNOWN, NONE)}}
        measured = [curve | closed for curve in measured]
    content = {
        "verdict": "ambiguous" if decision is None else decision.verdict,
        "final": decision is not None,
        "confirmed": decision is not None and decision.confirmed,
        "why": "" if decision is None else decision.sentence,
        "effects": [
            *(gap["effects"] if named else []),
            *borne_out,
            *measured,
        ],
        "rounds": [_round_content(site, r) for r in state.rounds],
        "predicted_before_run": _prediction(whole[-1], plan),
        "intervention": _intervention(decision, plan),
        "minimum_detectable": gap["minimum_detectable"],
        "detectable_units": gap.get("detectable_units", {}),
        "held_out": gap["held_out"],
        "motion_s": state.cost.motion_s,
        "wall_s": state.wall_s,
        "budget": {"declared": asdict(budget), "used": asdict(state.cost)},
        "arm": gap["arm"],
    }
    asked_for = planned / plan["models"][lead]["file"] if measured or borne_out else None
    model = asked_for or last / "model.yaml"
    write_whole(site.out / "model.yaml", model.read_text(encoding="utf-8"))
    seen = [_seen(site.out / r.folder / "weights.json") for r in state.rounds]
    text = page(content, _sentence(content), what_next(content, site.out), seen)
    write_whole(site.out / "report.html", text)
    write_whole(site.out / "investigation.json", json.dumps(content, indent=2))
    return content


def _seen(weights: Path) -> dict[str, Any]:
    """What `ident weigh` says of a round's predictions, by rival; empty where there were none."""
    return read(weights).get("predicted", {}) if weights.exists() else {}


def _beside_gap(gap: dict[str, Any], plan: dict[str, Any], lead: str) -> list[dict[str, Any]]:
    """The effects of an answer that leads though `ident gap` does not name it."""
    suspected = [e for e in gap.get("suspected", []) if place_of(e) == lead]
    written = plan.get("models", {}).get(lead, {}).get("effects", [])
    return suspected or ([] if lead == UNKNOWN else written)


def _round_content(site: Site, item: Any) -> dict[str, Any]:
    folder = item.folder
    has = {n: (site.out / folder / n).exists() for n in ("trajectory.yaml", "log.mcap", "gap.json")}
    files = {n.split(".")[0]: f"{folder}/{n}" if there else None for n, there in has.items()}
    return {
        "reason": item.reason,
        **files,
        "motion_s": item.cost.motion_s,
        "energy_j": item.cost.energy_j,
        "motor_load": item.cost.motor_load,
        "verdict": item.verdict,
        "answer": item.answer,
        "leader": item.leader,
        "evidence_nats": item.evidence,
        "asked_nats": item.asked,
        "bets": item.bets,
        "closed": item.closed,
        "stopped": item.stopped,
        "changed": item.changed,
        "odds": item.odds,
    }


def _prediction(last: Any, plan: dict[str, Any]) -> dict[str, Any]:
    """What was written down before the last motion, and how it came out."""
    if not plan or not last.leader:
        return {}
    return {
        "leader": last.leader,
        "models": plan["models"],
        "expected_nats": plan["motion"]["expected_nats"],
        "evidence_nats": last.evidence,
        "asked_nats": last.asked,
    }


def _intervention(decision: Decision | None, plan: dict[str, Any]) -> str | None:
    return plan.get("intervention") if decision and decision.verdict == "ambiguous" else None


def what_next(content: dict[str, Any], out: Path) -> str:
    """The command that comes next."""
    if content["final"] and content["verdict"] != "ambiguous":
        return f"ident validate OTHER.mcap --model {shlex.quote(str(out / 'model.yaml'))}"
    return "the same command with --resume, and with a larger --budget, or --answer CHANGE"


def _sentence(content: dict[str, Any]) -> str:
    """The verdict in a sentence."""
    names = words("+".join(dict.fromkeys(place_of(e) for e in content["effects"])))
    over = " and ".join(f"over {e['words']}" for e in content["effects"] if "words" in e)
    names += f", {over}" if over else ""
    borne = "confirmed on a new motion" if content["confirmed"] else "not confirmed"
    return {
        "named": f"The model misses {names} ({borne}).",
        "no_gap": f"No gap ({borne}); what could still hide is in the table.",
        "unknown": f"A gap without a name ({borne}){': ' + names if names else ''}.",
        "ambiguous": f"Undecided{' between ' + names + ' and its rivals' if names else ''}.",
    }[content["verdict"]]
