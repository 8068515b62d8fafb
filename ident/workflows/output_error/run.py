"""The work of `ident run --method simulation`, from files to files."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ident.checks.remark import Grade, Remark, joints, verdict_content
from ident.model.arm import Arm
from ident.output_error.identify import Found, identify_by_simulation
from ident.output_error.judging import rms
from ident.output_error.parameters import QUANTITIES
from ident.output_error.servo_model import ServoModel
from ident.output_error.setup import MotionSegment
from ident.output_error.uncertainty import unknown_factor
from ident.output_error.zero_poses import turned_zeros
from ident.recordings.loading import Reading
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.servos.run_page import ServoTrace, servo_page
from ident.signals.arrays import Array
from ident.workflows.output_error.commands import (
    command_remarks,
    early_remarks,
    gain_remarks,
    order_remarks,
    turned_remarks,
    zero_remarks,
)
from ident.workflows.output_error.following import fit_remarks, following
from ident.workflows.output_error.logs import read_commanded, read_remarks
from ident.workflows.run_json import numbers
from ident.workflows.work import Work, provenance

_STILL_S = 0.5  # that a joint stands still while the simulated one moves by
_FAR = 0.05  # rad, more than sticking did on a hobby arm: 0.02
_HARDLY = 0.1  # rad: a whole motion that is smaller is hardly one


@dataclass(frozen=True)
class ServoRun(Work):
    """An identification by simulation, and everything that is written about it.

    Attributes:
        found: the identification.
    """

    command: ClassVar[str] = "run"

    model: ServoModel
    found: Found

    def page(self) -> str:
        """The report, one HTML page."""
        return render(servo_page("ident run", self.content, traces(self.found)))


def run_simulation(
    paths: Sequence[Path],
    robot: Path | None,
    out: Path,
    reading: Reading,
    tell: Tell = silent,
    remarks: Sequence[Remark] = (),
) -> str:
    """Identify from commands and positions, and write; gives the content of `run.json`.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        out: folder for the results.
        reading: topics to read.
        tell: hears what is being done.
        remarks: what is known of the recordings already.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    arm, segments = read_commanded(paths, robot, reading)
    read = time.perf_counter() - start
    done = simulated_run(arm, segments, tell, remarks, paths)
    seconds = done.content["seconds"] | {"read": read, "total": time.perf_counter() - start}
    done.content["seconds"] = seconds
    tell("writing the report")
    return done.write(out)


def simulated_run(
    arm: Arm,
    segments: Sequence[MotionSegment],
    tell: Tell = silent,
    remarks: Sequence[Remark] = (),
    paths: Sequence[Path] = (),
) -> ServoRun:
    """Identify an arm from commands and positions that have been read; nothing is written."""
    start = time.perf_counter()
    found = identify_by_simulation(arm, segments, tell)
    told = read_remarks(arm, segments)
    content = verdict_content(
        [*remarks, *told, *_remarks(found, arm.robot.joint_names)]
    ) | _content(arm, found)
    content["provenance"] = provenance(arm, paths)
    content["seconds"] = {"solve": time.perf_counter() - start}
    content["solver"]["seconds"] = content["seconds"]["solve"]
    return ServoRun(found.model, content, found)


def traces(found: Found) -> tuple[ServoTrace, ...]:
    """The recordings beside the simulation."""
    made = found.setup.replay(found.fit.settings)
    pairs = zip(found.setup.segments, made, strict=True)
    return tuple(ServoTrace.of(s, q) for s, q in pairs)


def _remarks(found: Found, names: Sequence[str]) -> list[Remark]:
    said, held = [], np.flatnonzero(~found.moving)
    if len(held):
        said.append(
            Remark(
                "poor_motion",
                tuple(int(j) + 1 for j in held),
                f"No settings are fitted of {joints(held, names)}: no motion in the recordings.",
                Grade.TRUSTWORTHY,
            )
        )
    asked = np.ptp(np.concatenate([t.commanded for t in traces(found)]), axis=0)
    if len(unasked := np.flatnonzero(found.moving & (asked == 0.0))):
        text = (
            f"The command of {joints(unasked, names)} never changes: no delay is fitted there, and"
            " all else by what moves the joint against its servo."
        )
        advice = "Move it by commands as well, in these recordings or in others beside them."
        places = tuple(int(j) + 1 for j in unasked)
        said.append(Remark("poor_motion", places, text, Grade.TRUSTWORTHY, advice))
    loose = np.flatnonzero(unknown_factor(found.known) & found.moving)
    if len(loose):
        said.append(
            Remark(
                "torque_factor",
                tuple(int(j) + 1 for j in loose),
                "No known mass is lifted or accelerated enough to scale the torques of"
                f" {joints(loose, names)}: gains, friction, and rotor inertia are known only up to"
                " a common factor at each joint, on which positions do not depend.",
                Grade.TRUSTWORTHY,
                "Record with a known payload, or give the servo's gain in the arm's file (servo:"
                " fixed).",
            )
        )
    if (span := max(float(np.ptp(t.measured, axis=0).max()) for t in traces(found))) < _HARDLY:
        text = f"No joint moves through more than {span:.2g} rad."
        advice = "Check that positions and commands are in rad, or record larger motions."
        said.append(Remark("units", (), text, Grade.DOUBTFUL, advice))
    said += order_remarks(found.exchanged, names)
    said += gain_remarks(found.changed, names)
    said += command_remarks(traces(found), found.moving, names)
    said += zero_remarks(found.model, found.moving) or turned_remarks(
        turned_zeros(found.setup, found.fit.settings, found.moving), names
    )
    if not any(r.code == "commands" for r in said):
        said += early_remarks(found.early_s)
    errors = found.fit.rms, rms(found.search.errors)
    said += fit_remarks(*errors, traces(found), found.model.resolution, found.moving, names)
    late = any(r.code == "commands" for r in said)  # what does not follow these may move well
    if not late and (stalled := _stalled(found)):
        joint, where = stalled
        said.append(
            Remark(
                "stalled",
                (joint + 1,),
                f"{where}: {joints([joint], names)} stands still for {_STILL_S:g} s while the"
                f" simulated one moves by more than {_FAR:g} rad. Friction and inertia are fitted"
                " to that as well.",
                Grade.DOUBTFUL,
                "Cut contact, end stops, stalls and overload shutdowns out of the recordings.",
            )
        )
    return said


def _stalled(found: Found) -> tuple[int, str] | None:
    """The first joint that does not move where it should, and where that is; None: all do."""
    setup = found.setup
    for s, made in zip(setup.segments, setup.replay(found.fit.settings), strict=True):
        count = max(int(np.searchsorted(s.motion.t, s.motion.t[0] + _STILL_S)), 2)
        for k in range(s.counted, len(s.q) - count + 1, count):
            still = np.ptp(s.q[k : k + count], axis=0) <= 2.0 * found.model.resolution
            stuck = np.flatnonzero(
                found.moving & still & (np.ptp(made[k : k + count], axis=0) > _FAR)
            )
            if len(stuck):
                return int(stuck[0]), f"{s.name}, {s.motion.t[k]:.1f} s after its beginning"
    return None


def _content(arm: Arm, found: Found) -> dict[str, Any]:
    model, periods = found.model, [np.diff(s.motion.t) for s in found.setup.segments]
    free = found.fit.free
    return {
        "method": "simulation",
        "arm": arm.name,
        "samples": sum(len(s.q) for s in found.setup.segments),
        "joints": list(arm.robot.joint_names),
        "moving": [bool(m) for m in found.moving],
        "sample_rate_hz": float(1.0 / np.median(np.concatenate(periods))),
        "resolution_rad": model.resolution.tolist(),
        "logs": [
            {"name": s.name, "samples": len(s.q), "rms_q_by_joint": rms.tolist()}
            for s, rms in zip(found.setup.segments, _each(found), strict=True)
        ],
        "rms_q_by_joint": found.fit.rms.tolist(),
        "following_rms_by_joint": following(traces(found)).tolist(),
        "held_out": {"rms_q_by_joint": rms(found.search.errors).tolist()},
        "parameters": [
            {
                "name": q.name,
                "joint": int(j) + 1,
                "value": float(model.settings[i, j]),
                "sd": numbers(model.sd[i : i + 1, j])[0],
                "unit": q.unit,
                "meaning": q.text,
            }
            for i, q in enumerate(QUANTITIES)
            for j in np.flatnonzero(free[i])
        ],
        "lost_motion_rad": (model.value("coulomb") / model.value("stiffness")).tolist(),
        "torque_factor_sd": [x if np.isfinite(x) else None for x in found.known.torque_factor_sd],
        "parts_tried": [
            {
                "name": part.name,
                "gain_by_joint": gain.tolist(),
                "kept": found.search.kept(part).tolist(),
            }
            for part, gain in found.search.gains.items()
        ],
        "solver": {"name": "Levenberg-Marquardt", "status": "done", "rounds": found.fit.rounds},
    }


def _each(found: Found) -> list[Array]:
    return [np.sqrt(np.mean((t.measured - t.simulated) ** 2, axis=0)) for t in traces(found)]
