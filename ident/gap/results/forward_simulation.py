"""Simulation against measurement: the closed loop before and after, along the wanted motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of
from ident.effects.candidate import Candidate
from ident.gap.data.experiment import Experiment, controller_of, wire_of
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.selection.null_arms import can_simulate, null_arm, wanted_motion
from ident.recordings.steady_state import only_steady_state
from ident.simulation.arm import simulated_arm
from ident.simulation.loop import run

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Forward:
    """A recording and its simulation.

    Attributes:
        name: of the recording.
        t: time [s], shape (S,).
        measured, simulated: joint positions [rad], shape (S, n).
    """

    name: str
    t: Array
    measured: Array
    simulated: Array

    @property
    def squares(self) -> Array:
        """Mean squared position error [rad^2], shape (n,)."""
        return ((self.simulated - self.measured) ** 2).mean(axis=0)


def forward(
    source: Experiment, fitted: FeasibleModel, accepted: Sequence[Candidate]
) -> list[Forward]:
    """Every recording simulated with a model; none where controller or reference are unknown.

    The whole recording is simulated; its counted periods are compared.
    """
    controller, wire = controller_of(source), wire_of(source)
    if controller is None or wire is None or not can_simulate(source):
        return []
    n = source.arm.robot.dof
    still = simulated_arm(chain_of(source.arm.robot), np.zeros(10 * n), np.zeros(n), np.zeros(n))
    arm = null_arm(fitted, accepted, still)
    found = []
    for recording, data in zip(source.recordings, source.datasets, strict=True):
        columns = [recording.joint_names.index(j) for j in source.arm.robot.joint_names]
        motion = [np.ascontiguousarray(w[:, columns]) for w in wanted_motion(recording)]
        result = run(arm, controller, wire, (motion[0], motion[1], motion[2]))
        counted = only_steady_state(data, recording, data.name).segments[0]
        span = slice(*(counted.used or (0, min(len(result.q), len(recording.q)))))
        t = np.arange(len(result.q)) * wire.period_s
        measured = recording.q[:, columns]
        found.append(Forward(data.name, t[span], measured[span], result.q[span]))
    return found


def rms(runs: Sequence[Forward], moving: NDArray[np.bool_]) -> Array:
    """Rms position error over all runs [rad], shape (n,); not-a-number where unknown or held."""
    if not runs:
        return np.full(len(moving), np.nan)
    squares = np.mean([r.squares for r in runs], axis=0)
    return np.where(moving, np.sqrt(squares), np.nan)
