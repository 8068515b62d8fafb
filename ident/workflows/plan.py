"""The work of `ident plan` and `ident weigh`, from files to files."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from ident.effects.bound_effects import load_model
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from ident.excitation.problem.arm_limits import possible_pose
from ident.gap.data.experiment import read_experiment
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
    slowed,
    tracking,
)
from ident.planning.hypotheses import UNKNOWN, Answer, Hypothesis, hypotheses, read_answer
from ident.planning.noise import log_likelihood, read_noise, stretches
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
    fitted = hypotheses(read_experiment(logs), answer, Options(), tell)
    fitted.sort(key=lambda h: h.name != lead)  # a stable sort
    found = [replace(h, model=changed(h.model, change)) for h in fitted]
    tell("choosing the next motion")
    place = place_of(config, "all")
    tried = motions(place, found, _joints(found, answer), ran)
    if not tried:
        raise DataError("No motion is left that fits into the limits and has not run yet.")
    found = distinct(found, tried)
    models = _written(found, out / "models")
    odds = {h.name: 1.0 / max(1, len(found) - 1) for h in found[1:]}
    pose = possible_pose(place.arm, place.robot, place.limits, config)
    for best in sorted(tried, key=lambda m: -m.worth(odds)):
        design = designed(place, best, pose)
        shares = tracking(place, found, design.trajectory.series)
        if max(shares.values()) <= MOST_TRACKING:
            break
    else:
        raise DataError("No motion is left that the arm would follow under every answer.")
    _written_motions(design.trajectory, out)
    content = {
        "leader": found[0].name,
        "models": models,
        "measured": _measured(found[0]),
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
        path = folder / f"{number}.yaml"
        h.model.save(path)
        content[h.name] = {"file": f"models/{path.name}", "sha256": fingerprint(path)}
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


def _measured(leader: Hypothesis) -> dict[str, Any] | None:
    """An effect outside the catalogue as its measured curve; None: the leader has none."""
    if leader.name != UNKNOWN:
        return None
    record, values = leader.model.effects.records[-1], leader.estimates[-1]
    known = {n: {"value": v.value, "sd": v.sd, "unit": v.unit} for n, v in values.items()}
    return {
        "name": record.name,
        "joints": list(record.joints),
        "parameters": known,
        "equation": record.equation,
        "depends_on": record.variant,
        "between": [record.settings["low"], record.settings["high"]],
        "resembles": list(leader.resembles),
        "evidence": {},
        "rivals": [],
        "separating_experiment": None,
    }


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
    models = {}
    for name, item in written.items():
        path = plan / item["file"]
        if fingerprint(path) != item["sha256"]:
            raise DataError(f"{path} has changed since the plan was made: it is no prediction.")
        models[name] = load_model(path)
    arm = arm_of(next(iter(models.values())))
    found = []
    for log in logs:
        tell(f"weighing {log.name}")
        data = read_for(arm, log, Reading())
        motion = stretches(data)
        nats = {n: log_likelihood(m, noise, data, motion).tolist() for n, m in models.items()}
        found.append({"log": log.name, "log_likelihood": nats})
    return {"logs": found}
