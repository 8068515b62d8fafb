"""The work of `ident run --method simulation` where the recordings hold torque."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.identification.by_simulation import BySimulation, by_simulation
from ident.identification.identify import model_of
from ident.recordings.loading import Reading, commanded_joints
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.run_page import run_page, run_report
from ident.report.servos.driven_section import DrivenTrace, driven_sections
from ident.workflows.model_errors import errors_of_fit
from ident.workflows.run import Run
from ident.workflows.run_json import run_content
from wamctl.arm.errors import DataError
from wamctl.arm.joint_labels import joint_labels
from wamctl.arm.recording import LogFile, Recording


@dataclass(frozen=True)
class DrivenRun(Run):
    """An identification by simulation of recorded torque, and everything that is written about it.

    Attributes:
        simulated: what simulation found.
    """

    simulated: BySimulation

    def page(self) -> str:
        """The report, one HTML page."""
        page = run_page(run_report(self.content, self.found))
        labels = joint_labels(self.content["joints"])
        first, *others = page.sections
        further = driven_sections(self.content, _traces(self.simulated), labels)
        return render(replace(page, sections=[first, *further, *others]))


def are_driven(paths: Sequence[Path], robot: Path | None, reading: Reading) -> bool:
    """Whether logs hold the torque that drove an arm, and no commands of a position servo.

    Raises:
        DataError: a log that cannot be read.
        ConfigurationError: a robot file that cannot be used.
    """
    topics = reading.joint_states, reading.joint_commands
    return all(
        is_driven(LogFile(path, *topics, *commanded_joints(path, robot, reading))) for path in paths
    )


def is_driven(log: LogFile | Recording) -> bool:
    """The same of one log, or of a recording."""
    torque = False
    for piece in log.pieces():
        if b"\ncontroller:" in piece.attachments.get("config.yaml", b""):
            return True
        if piece.reference is not None:
            return False
        if piece.commands is not None:
            if piece.commands.q is not None:
                return False
            torque = torque or piece.commands.effort is not None
        torque = torque or (piece.states is not None and piece.states.effort is not None)
    return torque


def driven_run(done: Run, tell: Tell = silent) -> DrivenRun:
    """What simulation makes of recordings that regression has identified.

    Raises:
        DataError: what cannot be simulated.
    """
    if "gains" in done.content:
        raise DataError(
            "By simulation, recorded efforts drive the arm, so that they have to be torques, and"
            " these are currents: identify their gains by regression first."
        )
    made = by_simulation(done.found, tell)
    found, fit = made.found, made.fit
    content = done.content | run_content(found)
    content["solver"] |= {"rounds": fit.rounds}
    content |= {
        "method": "simulation",
        "errors": errors_of_fit(found),
        "rms_q_by_joint": fit.rms.tolist(),
        "held_out": {"rms_q_by_joint": made.held_out.tolist()},
        "tracking": {
            "stiffness_nm_per_rad": made.arm.stiffness.tolist(),
            "simulated_s": made.arm.setup.seconds,
        },
        "agreement": _agreement(made),
    }
    return DrivenRun(model_of(found), content, found, made)


def _agreement(made: BySimulation) -> dict[str, Any]:
    within, known = made.agreeing
    base, beta = made.found.evidence.base, made.found.estimates["ols"].beta
    columns = (beta, made.found.sd, made.regression, made.regression_sd, made.apart)
    numbers = [[float(x) if np.isfinite(x) else None for x in row] for row in np.array(columns).T]
    heads = ("simulation", "sd", "regression", "regression_sd", "apart")
    return {
        "within": within,
        "of": known,
        "base_parameters": [
            {"name": name, "unit": unit} | dict(zip(heads, row, strict=True))
            for name, unit, row in zip(base.names, base.units, numbers, strict=True)
        ],
    }


def _traces(made: BySimulation) -> tuple[DrivenTrace, ...]:
    setup = replace(made.arm.setup, delta=made.fit.links)
    pairs = zip(setup.segments, setup.replay(made.fit.settings), strict=True)
    return tuple(
        DrivenTrace(s.name, s.start_s + s.motion.t[s.counted :], s.q[s.counted :], q[s.counted :])
        for s, q in pairs
    )
