"""One round: choose, predict, run slowly, run, weigh, identify, ask for the gap."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from wamctl.arm.config import CanopenDrivesSection
from wamctl.arm.configuration.known_change import known_change
from wamctl.arm.errors import DataError, UserError
from wamctl.experiment.loop import Arm
from wamctl.investigation.budget import Cost, cost_of
from wamctl.investigation.decision import (
    NONE,
    asked_of,
    between,
    has_refuted_form,
    known,
    suspect_that_leads,
)
from wamctl.investigation.evidence import (
    SEARCH_NATS,
    odds,
    odds_text,
    signed_evidence,
    words,
)
from wamctl.investigation.intervention import with_change
from wamctl.investigation.programs import STOPPED, ProgramError, call
from wamctl.investigation.state import NAMED, NO_GAP, UNKNOWN, Round, State, made
from wamctl.investigation.weighing import compared, read

_EVENTS = ("contact", "dropped_samples")
_FIRST = "The first motion: what does the model miss at all?"


@dataclass(frozen=True)
class Site:
    """Where an investigation works.

    Attributes:
        out: its folder.
        arm: the arm's file and models.
        options: further options of `wamctl excite`, such as the operator's word.
        tell: is told what happens.
        ask: asks the operator to do something to the arm; gives the answer, empty for none.
        lock: of the bus, for the programs that move the arm; None: the simulated arm needs none.
        reached: which bound of the budget a further cost would reach, in words; None: none.
    """

    out: Path
    arm: Arm
    options: tuple[str, ...]
    tell: Callable[[str], None]
    ask: Callable[[str], str] = lambda _: ""
    lock: int | None = None
    reached: Callable[[Cost], str | None] = lambda _: None


class BudgetSpentError(UserError):
    """What is to be done next does not fit into the budget."""

    def __init__(self, reached: str) -> None:
        super().__init__(reached)
        self.reached = reached

    def __str__(self) -> str:
        return f"The budget does not allow it: {self.reached}."


def next_round(site: Site, state: State) -> Round:
    """Run a round, or what is left of it.

    Raises:
        ProgramError: one of its commands has failed; what is done is kept.
        DataError: a result that cannot be used, or no motion is left.
        BudgetSpentError: there is no room for the next motion, or for the rest of this one.
    """
    number = len(state.rounds) + 1
    folder = site.out / "rounds" / f"{number:02d}"
    whole = state.asked_for_gap
    plan = _planned(site, state, folder) if whole else {}
    reason = _reason(plan) if plan else _FIRST
    if state.pending:
        reason = f"The operator answered {state.pending}. {reason}"
    site.tell(f"round {number}: {reason}")
    try:
        logs = _recorded(site, state, folder, plan)
    except ProgramError as error:
        if error.exit_code != STOPPED or "operator" in error.said or not whole:
            raise
        return _stopped(state, folder, plan, reason, error.said)
    cost = _cost(site, logs)
    altered = bool(state.pending) and known_change(state.pending).alters_the_model
    if altered:
        verdict, answer, suspected = whole[-1].verdict, whole[-1].answer, whole[-1].suspected
        unexplained, rivals = whole[-1].unexplained, whole[-1].rivals
    else:
        site.tell("identifying, and asking for the gap")
        gap = _asked_for_gap([*logs_of(site.out, state), folder / "log.mcap"], folder)
        verdict, answer = _verdict(gap), answer_of(gap)
        suspected = [place_of(e) for e in gap.get("suspected", [])]
        unexplained, rivals = bool(gap.get("unexplained")), rivals_of(gap)
    bets, closed = _weighed(folder, logs, plan) if plan else ({}, {})
    leader = plan.get("leader", "")
    item = Round(
        reason=reason,
        motion=plan.get("motion", {}).get("name", ""),
        folder=str(folder.relative_to(site.out)),
        cost=cost,
        leader=leader,
        asked=asked_of(state.rounds, leader) if leader else 0.0,
        bets=bets,
        closed=closed,
        verdict=verdict,
        answer=answer,
        changed=state.pending,
        suspected=suspected,
        unexplained=unexplained,
        rivals=rivals,
        lookalikes=plan["models"][leader].get("lookalikes", ()) if leader else (),
        unsettled=plan.get("unsettled", ()),
    )
    rounds = (*state.rounds, item)
    return replace(item, evidence=known(rounds, leader), odds=_odds(rounds))


def logs_of(out: Path, state: State) -> list[Path]:
    """The logs of all rounds that were run at full speed on the arm as it was."""
    whole = [r for r in state.rounds if r.stopped is None and not r.is_altered]
    return [out / r.folder / "log.mcap" for r in whole]


def answer_of(gap: Mapping[str, Any]) -> str:
    """Effects of a gap with their joints in one word, such as `stribeck:4`; empty for none.

    Events of one log, such as a contact, cannot be predicted of another one.
    """
    return "+".join(sorted(place_of(e) for e in gap["effects"] if e["name"] not in _EVENTS))


def rivals_of(gap: Mapping[str, Any]) -> list[str]:
    """Answers that `ident gap` cannot tell from its own: each has another effect in one place."""
    effects = [e for e in gap["effects"] if e["name"] not in _EVENTS]
    others = [(e, r) for e in effects for r in e["rivals"] if r["name"] not in _EVENTS]
    places = [[place_of(r if x is e else x) for x in effects] for e, r in others]
    return list(dict.fromkeys("+".join(sorted(p)) for p in places))


def place_of(effect: Mapping[str, Any]) -> str:
    """An effect of `gap.json` with its joints, such as `stribeck:4`."""
    return f"{effect['name']}:{'-'.join(map(str, effect['joints']))}"


def _verdict(gap: Mapping[str, Any]) -> str:
    """The verdict; a log in which only events were named shows no gap."""
    only_events = gap["verdict"] == NAMED and not answer_of(gap)
    return NO_GAP if only_events else gap["verdict"]


def _planned(site: Site, state: State, folder: Path) -> dict[str, Any]:
    """Choose the next motion, and write down what each answer predicts of it."""
    _check_room(site, Cost())
    site.tell("choosing the next motion, and writing down what each answer predicts")
    logs = logs_of(site.out, state)
    ran = [] if state.pending else [r.motion for r in state.rounds if r.motion]
    last = state.asked_for_gap[-1]
    options = ["--config", state.request.config, "--gap", str(site.out / last.folder)]
    options += [part for name in ran for part in ("--ran", name)]
    options += ["--changed", state.pending] if state.pending else []
    lead = suspect_that_leads(state.rounds)
    options += ["--lead", lead] if lead else []
    plan = made(
        folder / "plan",
        lambda path: call("ident.cli", ["plan", *map(str, logs), *options, "--out", str(path)]),
    )
    trajectory = plan / "trajectory.yaml"
    made(folder / "trajectory.yaml", lambda p: _copied(trajectory, p))
    return read(plan / "plan.json")


def _copied(source: Path, target: Path) -> None:
    target.write_bytes(source.read_bytes())


def _reason(plan: Mapping[str, Any]) -> str:
    motion = plan["motion"]
    gains = sorted(motion["expected_nats"].items(), key=lambda item: item[1])
    told = ", ".join(f"{odds_text(nats)} over {words(rival)}" for rival, nats in gains)
    return (
        f"{motion['words']} It is expected to tell {words(plan['leader'])} soonest, with"
        f" odds of {told}."
    )


def _recorded(site: Site, state: State, folder: Path, plan: Mapping[str, Any]) -> list[Path]:
    """The round's logs; a motion that was planned runs at a quarter of its speed first.

    Each run begins only if there is room for it.
    """
    request = with_change(state.request, state.pending, folder)
    motions = [("slow", folder / "plan" / "slow.yaml")] if plan else []
    if not plan:
        made(folder / "trajectory.yaml", lambda p: _copied(Path(str(request.trajectory)), p))
    motions.append(("log", folder / "trajectory.yaml"))
    logs = list[Path]()
    for name, trajectory in motions:
        if not (folder / f"{name}.mcap").exists():
            _check_room(site, _expected(plan) if name == "slow" else _cost(site, logs))
        site.tell("a quarter of the speed first" if name == "slow" else "the motion")
        options = ["--config", request.config, "--bus", request.bus, "--seed", str(request.seed)]
        options += ["--lockstep"] if request.lockstep else []
        options += ["--hidden", request.hidden] if request.hidden else []
        options += ["--trajectory", str(trajectory), *site.options]
        logs.append(_run(folder / f"{name}.mcap", options, site.lock))
    return logs


def _cost(site: Site, logs: Sequence[Path]) -> Cost:
    """What runs have cost together."""
    cost = Cost()
    for log in logs:
        cost = cost.plus(cost_of(log, site.arm.transmission, _continuous_nm(site.arm)))
    return cost


def _expected(plan: Mapping[str, Any]) -> Cost:
    """What both runs of a planned motion will cost."""
    motion = plan["motion"]
    return Cost(float(motion["seconds"]), float(motion.get("energy_j", 0.0)))


def _check_room(site: Site, cost: Cost) -> None:
    reached = site.reached(cost)
    if reached is not None:
        raise BudgetSpentError(f"with the next motion {reached}")


def _run(log: Path, options: Sequence[str], lock: int | None) -> Path:
    """The log of a run that came to its end; those of others stay beside it."""
    if log.exists():
        return log
    running = log.with_name(f"{log.stem}-unfinished.mcap")
    if running.exists():
        earlier = len(list(log.parent.glob(f"{log.stem}-ended-*.mcap")))
        running.replace(log.with_name(f"{log.stem}-ended-{earlier + 1}.mcap"))
    call("wamctl.cli", ["excite", *options, "--out", str(running)], lock)
    return running.replace(log)


def _stopped(state: State, folder: Path, plan: Mapping[str, Any], reason: str, said: str) -> Round:
    """A round whose motion a limit has ended: evidence, but none that is weighed."""
    motion = plan.get("motion", {})
    return Round(
        reason=reason,
        motion=motion.get("name", ""),
        folder=f"rounds/{folder.name}",
        cost=Cost(motion_s=float(motion.get("seconds", 0.0)), stops=1),
        leader=plan.get("leader", ""),
        odds=state.rounds[-1].odds if state.rounds else {},
        stopped=said,
        changed=state.pending,
    )


def _continuous_nm(arm: Arm) -> tuple[float, ...]:
    """Torque that each motor stands for ever; where its data do not say, the limit's."""
    drives = arm.file.drives
    if isinstance(drives, CanopenDrivesSection):
        return drives.rated_torque_nm
    return arm.file.limits.motor_torque_nm


def _asked_for_gap(logs: Sequence[Path], folder: Path) -> dict[str, Any]:
    """`ident gap` on all logs, which identifies as well; its files go to the round's folder."""
    paths = [str(log) for log in logs]
    found = made(folder / "gap", lambda p: call("ident.cli", ["gap", *paths, "--out", str(p)]))
    for name in ("model.yaml", "report.html", "gap.json"):
        made(folder / name, lambda p, name=name: _copied(found / name, p))
    gap = read(folder / "gap.json")
    if gap["verdict"] == "data_fault":
        said = "; ".join(r["sentence"] for r in gap.get("remarks", [])) or "see its report"
        raise DataError(f"The logs cannot be trusted ({folder / 'report.html'}): {said}")
    return gap


def _weighed(
    folder: Path, logs: Sequence[Path], plan: Mapping[str, Any]
) -> tuple[dict[str, list[float]], dict[str, float]]:
    """What a round's logs say of the answers of its plan, see `compared`."""
    names = [str(log) for log in logs]
    options = ["--plan", str(folder / "plan")]
    path = made(
        folder / "weights.json",
        lambda p: call("ident.cli", ["weigh", *names, *options, "--out", str(p)]),
    )
    return compared(path, plan["leader"])


def _odds(rounds: Sequence[Round]) -> dict[str, float]:
    """What is believed after a round.

    The last search has seen the logs of all earlier ones. A measured curve that predicts badly
    speaks against itself, not against an effect that has no name, if the search still sees one.
    """
    pairs: dict[tuple[str, str], list[list[float]]] = {}
    for item in rounds:
        for rival, won in item.bets.items():
            pairs.setdefault((item.leader, rival), []).append(won)
    last = rounds[-1]
    refuted = [a for a in (last.answer, *last.suspected) if has_refuted_form(rounds, a)]
    if refuted:  # against no effect both may stand as far ahead as so many blocks can tell
        pairs = {(UNKNOWN, a): between(rounds, UNKNOWN, a) for a in (last.leader, *last.bets)}
        pairs.pop((UNKNOWN, UNKNOWN), None)
    if last.verdict == UNKNOWN:
        pairs = {p: b for p, b in pairs.items() if p[0] != UNKNOWN or signed_evidence(b) > 0.0}
    open_names = [a for a in last.suspected if a not in refuted]
    whole = open_names if last.verdict == UNKNOWN and last.is_suspicion else ()
    likely = [*whole] or [UNKNOWN if last.verdict == UNKNOWN else last.answer or NONE]
    likely += last.rivals
    seen = dict.fromkeys([NONE, *last.suspected, last.leader or NONE], 0.0)
    seen |= dict.fromkeys([UNKNOWN] if last.verdict == UNKNOWN else [], 0.0)
    seen |= dict.fromkeys(likely, SEARCH_NATS)
    pairs.setdefault((last.leader or NONE, UNKNOWN), [])  # an answer at all times
    altered = any(r.is_altered for r in rounds)  # no search has seen that motion
    return odds(seen, pairs, () if altered or whole else likely)
