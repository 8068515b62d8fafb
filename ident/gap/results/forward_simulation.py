"""Forward simulation of the recordings in closed loop, along their reference motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.gap.data.experiment import Experiment, controller_of, wire_of
from ident.gap.nulls.null_arms import can_simulate, null_arm, reference_motion
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.recordings.steady_state import only_steady_state
from ident.signals.arrays import Array
from ident.simulation.loop import run


@dataclass(frozen=True)
class ForwardSimulation:
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


def forward_simulations(
    source: Experiment, fitted: FeasibleModel, accepted: Sequence[Candidate]
) -> list[ForwardSimulation]:
    """Every recording simulated with a model; empty if controller or reference are unknown.

    The whole recording is simulated; only its steady-state periods are compared.
    """
    controller, wire = controller_of(source), wire_of(source)
    if controller is None or wire is None or not can_simulate(source):
        return []
    arm = null_arm(source, fitted, accepted)
    found = []
    for recording, data in zip(source.recordings, source.datasets, strict=True):
        motion, columns = reference_motion(source, recording)
        result = run(arm, controller, wire, motion)
        counted = only_steady_state(data, recording, data.name).segments[0]
        span = slice(*(counted.used or (0, min(len(result.q), len(recording.q)))))
        t = np.arange(len(result.q)) * wire.period_s
        measured = recording.q[:, columns]
        found.append(ForwardSimulation(data.name, t[span], measured[span], result.q[span]))
    return found


def rms(runs: Sequence[ForwardSimulation], moving: NDArray[np.bool_]) -> Array:
    """Rms position error over all runs [rad], shape (n,); not-a-number if unknown or held."""
    if not runs:
        return np.full(len(moving), np.nan)
    squares = np.mean([r.squares for r in runs], axis=0)
    return np.where(moving, np.sqrt(squares), np.nan)
