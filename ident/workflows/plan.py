"""The work of `ident plan` and `ident weigh`, from files to files."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from ident.dynamics.regressor import Motion as Samples
from ident.effects.bound_effects import load_model
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from ident.effects.measured_effect import KNOTS, MeasuredEffect, curve_in_words
from ident.excitation.problem.arm_limits import possible_pose
from ident.gap.data.experiment import read_experiment
from ident.gap.data.windows import windows_for
from ident.gap.nulls.null_arms import can_simulate, reference_motion
from ident.gap.options import Options
from ident.identification.validation import arm_of
from ident.model.identified_model import Model
from ident.planning.changed_arm import changed
from ident.planning.choice import (
    MOST_TRACKING,
    Motion,
    designed,
    distinct,
    motions,
    rehearsed,
    slowed,
    that_followed,
)
from ident.planning.hypotheses import (
    UNKNOWN,
    Answer,
    Hypothesis,
    hypotheses,
    in_its_place,
    lookalikes,
    read_answer,
    unsettled,
)
from ident.planning.known import (
    Known,
    Prediction,
    against_rival,
    log_likelihood,
    predictions,
    read_known,
    squares_of,
)
from ident.planning.noise import read_noise, stretches
from ident.recordings.loading import Reading, fingerprint, read_for
from ident.workflows.design import place_of
from ident.workflows.run_json import as_json
from wamctl.arm.configuration.known_change import KnownChange
from wamctl.arm.errors import DataError
from wamctl.arm.trajectory import Trajectory, write_trajectory

Tell = Callable[[str], None]

AS_IT_WAS = KnownChange()

_JOINTS = 2
"""So many joints are looked at; each has all the probes."""


@threadpool_limits.wrap(limits=1)
def plan_logs(
    logs: Sequence[Path],
    gap: Path,
    config: Path,
    out: Path,
    ran: Sequence[str],
    tell: Tell,
    change: KnownChange = AS_IT_WAS,
    lead: str | None = None,
) -> dict[str, Any]:
    """Fit rival answers, choose the motion that tells them apart, and write both down.

    `out` gets `plan.json`, `trajectory.yaml`, `slow.yaml` (the same at a quarter of its speed) and
    the answers in `models`.

    Args:
        logs: all recordings so far.
        gap: folder of `ident gap` on them.
        config: the arm's file.
        out: folder for the results.
        ran: names of motions that are not repeated.
        tell: is told the progress.
        change: what has been done to the arm since the last recording.
        lead: answer that leads where it is one of the rivals; None: that of `gap`.

    Raises:
        UserError: a file that cannot be used, or no motion within the limits.
    """
    start = time.perf_counter()
    answer = read_answer(gap)
    tell("reading")
    source, place = read_experiment(logs), place_of(config, "all")
    fitted = hypotheses(source, answer, Options(), tell, lead)
    fitted.sort(key=lambda h: h.name != lead)  # a stable sort
    open_answers = unsettled(fitted)
    fitted = in_its_place(fitted)
    if can_simulate(source):
        ran_last = Samples(*reference_motion(source, source.recordings[-1])[0])
        fitted = that_followed(place, fitted, ran_last)
    found = [replace(h, model=changed(h.model, change)) for h in fitted]
    tell("choosing the next motion")
    tried = motions(place, found, _joints(found, answer), ran)
    if not tried:
        raise DataError("No motion is left that fits into the limits and has not run yet.")
    found = distinct(found, tried)
    models = _written(found, out / "models")
    odds = {h.name: 1.0 / max(1, len(found) - 1) for h in found[1:]}
    pose = possible_pose(place.arm, place.robot, place.limits, config)
    for best in sorted(tried, key=lambda m: -m.worth(odds)):
        design = designed(place, best, pose)
        shares = rehearsed(place, found, design.trajectory.series)
        if max(shares.values()) <= MOST_TRACKING:
            break
    else:
        raise DataError("No motion is left that the arm would follow under every answer.")
    _written_motions(design.trajectory, out)
    content = {
        "leader": found[0].name,
        "models": models,
        "measured": _measured(found),
        "unsettled": open_answers,
        "intervention": _intervention(found[0].model),
        "changed": asdict(change) if change.alters_the_model else None,
        "motion": _motion_content(best, odds),
        "rehearsed_tracking": shares,
        "noise": found[0].noise.content(),
        "tried": [_motion_content(m, odds) for m in tried],
        "seconds": time.perf_counter() - start,
    }
    (out / "plan.json").write_text(as_json(content), encoding="utf-8")
    return content


def _written(found: Sequence[Hypothesis], folder: Path) -> dict[str, Any]:
    """Write the answers; gives their files and what these hold, by name."""
    folder.mkdir(parents=True, exist_ok=True)
    content = {}
    for number, h in enumerate(found):
        model, known = folder / f"{number}.yaml", folder / f"{number}-known.json"
        h.model.save(model)
        known.write_text(json.dumps(h.known.content()), encoding="utf-8")
        content[h.name] = {
            "file": f"models/{model.name}",
            "sha256": fingerprint(model),
            "known": f"models/{known.name}",
            "known_sha256": fingerprint(known),
            "effects": _effects_content(h),
            "lookalikes": lookalikes(h, found),
        }
    return content


def _written_motions(trajectory: Trajectory, out: Path) -> None:
    write_trajectory(out / "trajectory.yaml", trajectory)
    slow = replace(trajectory, series=slowed(trajectory.series), periods=1, promise={})
    write_trajectory(out / "slow.yaml", slow)


def _joints(found: Sequence[Hypothesis], answer: Answer) -> list[int]:
    """The joints to look at, from 0: those of the answers, the leading one's first."""
    left = [u["joint"] - 1 for u in answer.content.get("unexplained") or []]
    named = [j - 1 for h in found for r in h.model.effects.records for j in r.joints[:1]]
    return list(dict.fromkeys([*left, *named, 1, 3]))[:_JOINTS]


def _measured(found: Sequence[Hypothesis]) -> list[dict[str, Any]]:
    """An effect outside the catalogue as its measured curves; none where no answer has one."""
    for h in found:
        if h.name == UNKNOWN:
            pairs = zip(h.model.effects.records, _effects_content(h), strict=True)
            return [
                told
                | {
                    "joints": list(record.rows),
                    "depends_on": record.variant,
                    "words": curve_in_words(record.variant, record.joints),
                    "between": [record.settings["low"], record.settings["high"]],
                    "corners": record.settings.get("knots", KNOTS),
                    "resembles": list(h.resembles),
                }
                for record, told in pairs
                if record.name == MeasuredEffect.id
            ]
    return []


def _effects_content(answer: Hypothesis) -> list[dict[str, Any]]:
    """The effects of an answer, as `gap.json` tells them."""
    return [
        {
            "name": record.name,
            "joints": list(record.joints),
            "parameters": {n: asdict(v) for n, v in values.items()},
            "equation": record.equation,
            "evidence": {},
            "rivals": [],
            "separating_experiment": None,
        }
        for record, values in zip(answer.model.effects.records, answer.estimates, strict=True)
    ]


def _intervention(model: Model) -> str:
    """What the operator may do where no motion tells the leading answer from its rivals."""
    records = model.effects.records
    return catalogue()[records[0].name].intervention if records else Effect.intervention


def _motion_content(motion: Motion, odds: dict[str, float]) -> dict[str, Any]:
    return {
        "name": motion.name,
        "words": motion.words,
        "seconds": motion.seconds,
        "energy_j": motion.energy_j,
        "expected_nats": {rival: motion.gains[rival] for rival in odds},
        "worth_nats_per_s": motion.worth(odds),
    }


@threadpool_limits.wrap(limits=1)
def weigh_logs(logs: Sequence[Path], plan: Path, tell: Tell) -> dict[str, Any]:
    """How well the answers of a plan predicted some logs.

    Raises:
        DataError: no plan, or models that are not those that were written down.
        UserError: a log that cannot be used.
    """
    try:
        content = json.loads((plan / "plan.json").read_text(encoding="utf-8"))
        written, noise = content["models"], read_noise(content["noise"])
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise DataError(f"{plan} holds no plan.json that can be read ({error!r}).") from error
    answers = {name: _as_written(plan, item) for name, item in written.items()}
    arm = arm_of(next(iter(answers.values()))[0])
    found = []
    told: dict[str, list[Prediction]] = {name: [] for name in answers}
    for log in logs:
        tell(f"weighing {log.name}")
        data = read_for(arm, log, Reading())
        motion, windows = stretches(data), windows_for(data.rate_hz, noise.cutoff_hz)
        here = {n: predictions(m, k, noise, data, motion) for n, (m, k) in answers.items()}
        nats = {n: log_likelihood(p, answers[n][1], windows).tolist() for n, p in here.items()}
        squares = {n: squares_of(p).tolist() for n, p in here.items()}
        found.append({"log": log.name, "log_likelihood": nats, "squares": squares})
        told = {n: [*told[n], *here[n]] for n in told}
    leader = content["leader"]
    rivals = [n for n in told if n != leader] if found else []
    seen = {n: against_rival(told[leader], told[n], answers[n][1]) for n in rivals}
    return {"logs": found, "predicted": seen}


def _as_written(plan: Path, item: dict[str, Any]) -> tuple[Model, Known]:
    """An answer of a plan, and what was known of its numbers.

    Raises:
        DataError: files that are not those that were written down.
    """
    for name in ("file", "known"):
        path = plan / item[name]
        if fingerprint(path) != item["sha256" if name == "file" else "known_sha256"]:
            raise DataError(f"{path} has changed since the plan was made: it is no prediction.")
    known = json.loads((plan / item["known"]).read_text(encoding="utf-8"))
    return load_model(plan / item["file"]), read_known(known)
