"""Effect-free data: the fitted arm simulated in closed loop, and noise with random phases.

The simulation has the recordings' controller, reference, encoders and torque steps, and reverses in
several ways, so that it shows the systematic errors of the whole chain. Random phases (Theiler et
al. 1992) keep the spectrum of the residual and nothing else, so that they show chance.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import Experiment
from ident.gap.data.noise_regions import Region
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.regression.residuals import Residual
from ident.recordings.dataset import Dataset, Segment, in_memory
from ident.recordings.samples import held_mean
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm, simulated_arm
from ident.simulation.loop import Controller, Wire, run
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

Motion = tuple[Array, Array, Array]


def can_simulate(source: Experiment) -> bool:
    """Whether all recordings hold their reference motion."""
    return all(r.reference is not None and len(r.reference.stamp_ns) > 1 for r in source.recordings)


def null_arm(
    source: Experiment, fitted: FeasibleModel, accepted: Sequence[Candidate]
) -> SimulatedArm:
    """The fitted arm with its accepted effects."""
    arm = simulated_arm(chain_of(source.arm.robot), fitted.inertial, fitted.viscous, fitted.coulomb)
    for h, values in zip(accepted, fitted.effects, strict=True):
        arm = catalogue()[h.effect].simulated(arm, h, values)
    return arm


def reference_motion(source: Experiment, recording: Recording) -> tuple[Motion, list[int]]:
    """Reference position, velocity and acceleration, shape (S, n), and the joints' columns.

    Raises:
        ValueError: the recording has none, see `can_simulate`.
    """
    series = recording.reference
    if series is None:
        raise ValueError("a recording without reference cannot be simulated")
    columns = [recording.joint_names.index(j) for j in source.arm.robot.joint_names]
    q, qd, qdd = (np.ascontiguousarray(w[:, columns]) for w in (series.q, series.qd, series.qdd))
    return (q, qd, qdd), columns


def simulated_datasets(
    source: Experiment,
    arm: SimulatedArm,
    loop: tuple[Controller, Wire],
    disturbance: Sequence[Array],
    rng: np.random.Generator,
    presliding_rad: float,
) -> list[Dataset]:
    """The recordings as they would be if the arm were exactly the fitted one.

    Raises:
        DataError: the simulated arm does not follow its reference.
    """
    drawn = presliding_rad * rng.choice((0.0, 0.0, 0.4, 1.0), len(arm.coulomb))
    arm = replace(arm, bristle=np.where(arm.bristle > 0.0, arm.bristle, drawn))
    found = []
    for recording, data, noise in zip(source.recordings, source.datasets, disturbance, strict=True):
        motion, _ = reference_motion(source, recording)
        result = run(arm, *loop, motion, noise)
        if not (np.isfinite(result.q).all() and np.isfinite(result.tau_cmd).all()):
            raise DataError(f"{data.name}: the fitted arm does not follow the reference.")
        t = np.arange(len(result.q)) * loop[1].period_s
        tau = held_mean(t, result.tau_cmd, t, loop[1].period_s)
        found.append(in_memory(data, 1 / loop[1].period_s, [Segment(0.0, result.q, tau)]))
    return found


def phase_randomised(residual: Residual, rng: np.random.Generator) -> Array:
    """A series with the sliding residual's spectrum and random phases, shape (R,).

    Rows at reversals and excluded rows are first replaced by draws of the others, since their
    residual is systematic.
    """
    values = residual.values.copy()
    if len(values) == 0:
        return values
    usual = (residual.region == Region.SLIDING) & ~residual.excluded
    if usual.any():
        values[~usual] = rng.choice(values[usual], int((~usual).sum()))
    spectrum = np.fft.rfft(values - values.mean())
    spectrum *= np.exp(2j * np.pi * rng.random(len(spectrum)))
    return np.fft.irfft(spectrum, len(values))
