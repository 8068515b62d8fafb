"""The work of `ident validate` with a model of servos: closed-loop replay, from files to files."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ident.checks.remark import verdict_content
from ident.model.arm import Arm, arm_from_urdf
from ident.output_error.servo_model import ServoModel, read_servo_model
from ident.recordings.loading import Reading
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.servos.run_page import ServoTrace, servo_page
from ident.signals.arrays import Array
from ident.workflows.output_error.commands import command_remarks
from ident.workflows.output_error.following import (
    far_worse,
    following,
    hardly_better,
    no_better_remark,
)
from ident.workflows.output_error.logs import glitch_remarks, read_commanded_for
from ident.workflows.work import provenance, write_results


def validate_simulation(
    paths: Sequence[Path], model_path: Path, out: Path, reading: Reading, tell: Tell = silent
) -> str:
    """Replay recordings with a model and write the errors; gives the content of `validate.json`.

    Args:
        paths: the logs.
        model_path: a `model.yaml` of `ident run --method simulation`.
        out: folder for the results.
        reading: topics to read.
        tell: hears what is being done.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    model = read_servo_model(model_path)
    moving = np.asarray(np.isfinite(model.sd).any(axis=0))
    traces, logs, told = [], [], []
    for path in paths:
        tell(f"replaying {path.name}")
        segments = read_commanded_for(model.robot.joint_names, path, reading)
        told += glitch_remarks(segments, model.robot.joint_names)
        mine = [ServoTrace.of(s, model.replay(s)) for s in segments]
        traces += mine
        logs.append(_log(str(path), mine))
        bad = hardly_better(_rms(mine), mine, model.resolution, moving)
        if len(bad):
            told.append(no_better_remark(bad, model.robot.joint_names, f"{path.name}:"))
        told += far_worse(path.name, _rms(mine), model, np.setdiff1d(np.flatnonzero(moving), bad))
        told += command_remarks(mine, moving, model.robot.joint_names)
    content: dict[str, Any] = {
        **verdict_content(told),
        "method": "simulation",
        "arm": model.arm,
        "model": str(model_path),
        "fitted_on": list(model.logs),
        "joints": list(model.robot.joint_names),
        "moving": moving.tolist(),
        "logs": logs,
        **_errors(traces),
        "provenance": provenance(_arm(model, model_path), paths),
        "seconds": {"total": time.perf_counter() - start},
    }
    page = render(servo_page("ident validate", content, traces))
    return write_results(out, "validate", content, page)


def _log(name: str, traces: Sequence[ServoTrace]) -> dict[str, Any]:
    samples = sum(len(t.t) for t in traces)
    period = float(np.median(np.concatenate([np.diff(t.t) for t in traces])))
    head = {"name": name, "samples": samples, "sample_rate_hz": 1.0 / period}
    return head | _errors(traces)


def _errors(traces: Sequence[ServoTrace]) -> dict[str, Any]:
    return {
        "rms_q_by_joint": _rms(traces).tolist(),
        "following_rms_by_joint": following(traces).tolist(),
    }


def _rms(traces: Sequence[ServoTrace]) -> Array:
    left = np.concatenate([t.measured - t.simulated for t in traces])
    return np.sqrt(np.mean(left**2, axis=0))


def _arm(model: ServoModel, path: Path) -> Arm:
    return arm_from_urdf(model.robot.urdf, model.robot.joint_names, str(path))
