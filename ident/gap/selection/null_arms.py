"""Effect-free data through the identical chain: how large a gain can nothing have?

Two kinds: the fitted arm simulated in closed loop, with its own controller, reference, encoder and
torque steps, and with several ways of turning round (systematic errors of the chain); and the
fitted model's torque with the residual's phases drawn anew (chance).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.events import CONTACT
from ident.gap.data.experiment import Experiment
from ident.gap.data.noise_regions import Region
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.regression.residuals import Residual
from ident.recordings.dataset import Dataset, Segment, in_memory
from ident.recordings.samples import held_mean
from ident.simulation.arm import SimulatedArm
from ident.simulation.loop import Controller, Wire, run
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

Array = NDArray[np.floating]

_DISTANCES = (0.0, 0.0, 2e-4, 5e-4)
"""Presliding distances drawn for joints without presliding [rad]: the same as sticking."""

_ROOM = 2.0
_LEAST_GAIN = 0.04
_LEAST_BESIDE_TRUSTED = 0.1
_LEAST_BURST = 0.15  # a segment of time is found among hundreds, in any residual


@dataclass(frozen=True)
class Threshold:
    """What an effect must gain to be believed.

    Attributes:
        gain: [nats per sample], by effect id.
        leftover: structure without a name must gain this much.
        draws: effect-free runs behind it.
    """

    gain: dict[str, float]
    leftover: float
    draws: int

    def of(self, effect: str) -> float:
        """The gain that the effect must reach."""
        return self.gain.get(effect, _LEAST_GAIN)


def least_threshold(trusted: bool = False) -> Threshold:
    """What every data set asks for, before anything is simulated.

    A trusted model brings errors of its own, which no simulation of it shows: more is asked then.
    """
    least = _LEAST_BESIDE_TRUSTED if trusted else _LEAST_GAIN
    gain = dict.fromkeys(catalogue(), least) | {CONTACT.id: _LEAST_BURST}
    return Threshold(gain, 2 * least, 0)


def raised(
    threshold: Threshold, gains: Sequence[dict[str, float]], leftover: Sequence[float]
) -> Threshold:
    """The threshold with more effect-free runs behind it.

    Args:
        threshold: so far.
        gains: largest gain of each effect in each run.
        leftover: largest gain of nameless structure in each run.
    """
    gain = dict(threshold.gain)
    for run_gains in gains:
        for effect, value in run_gains.items():
            gain[effect] = max(gain.get(effect, _LEAST_GAIN), _ROOM * value)
    most = max([threshold.leftover, *(_ROOM * x for x in leftover)])
    return Threshold(gain, most, threshold.draws + len(gains))


def can_simulate(source: Experiment) -> bool:
    """Whether references are in all recordings."""
    return all(_has_reference(r) for r in source.recordings)


def null_arm(
    fitted: FeasibleModel, accepted: Sequence[Candidate], chain_arm: SimulatedArm
) -> SimulatedArm:
    """The fitted arm with its accepted effects."""
    arm = replace(chain_arm, delta=fitted.inertial, viscous=fitted.viscous, coulomb=fitted.coulomb)
    for h, values in zip(accepted, fitted.effects, strict=True):
        arm = catalogue()[h.effect].simulated(arm, h, values)
    return arm


def simulated_datasets(
    source: Experiment,
    arm: SimulatedArm,
    loop: tuple[Controller, Wire],
    disturbance: Sequence[Array],
    rng: np.random.Generator,
) -> list[Dataset]:
    """The recordings, had the arm been exactly the fitted one.

    Raises:
        DataError: the simulated arm does not follow its reference.
    """
    drawn = rng.choice(_DISTANCES, len(arm.coulomb))
    arm = replace(arm, bristle=np.where(arm.bristle > 0.0, arm.bristle, drawn))
    found = []
    for recording, data, noise in zip(source.recordings, source.datasets, disturbance, strict=True):
        columns = [recording.joint_names.index(j) for j in source.arm.robot.joint_names]
        motion = tuple(np.ascontiguousarray(w[:, columns]) for w in wanted_motion(recording))
        result = run(arm, *loop, (motion[0], motion[1], motion[2]), noise)
        if not (np.isfinite(result.q).all() and np.isfinite(result.tau_cmd).all()):
            raise DataError(f"{data.name}: the fitted arm does not follow the reference.")
        t = np.arange(len(result.q)) * loop[1].period_s
        tau = held_mean(t, result.tau_cmd, t, loop[1].period_s)
        segment = Segment(0.0, result.q, tau)
        found.append(in_memory(data, 1 / loop[1].period_s, [segment]))
    return found


def _has_reference(recording: Recording) -> bool:
    return recording.reference is not None and len(recording.reference.stamp_ns) > 1


def wanted_motion(recording: Recording) -> tuple[Array, Array, Array]:
    """Reference position, velocity and acceleration, each of shape (S, n).

    Raises:
        ValueError: the recording has none, see `can_simulate`.
    """
    series = recording.reference
    if series is None:
        raise ValueError("a recording without reference cannot be simulated")
    return series.q, series.qd, series.qdd


def phase_randomised(residual: Residual, rng: np.random.Generator) -> Array:
    """A series with the sliding residual's spectrum and other phases, shape (R,).

    Rows where the joint or a shared motor turns round, and those that stand apart, are first
    replaced by draws of the others: what happens there is systematic.
    """
    values = residual.values.copy()
    if len(values) == 0:
        return values
    usual = (residual.region == Region.SLIDING) & ~residual.apart
    if usual.any():
        values[~usual] = rng.choice(values[usual], int((~usual).sum()))
    spectrum = np.fft.rfft(values - values.mean())
    spectrum *= np.exp(2j * np.pi * rng.random(len(spectrum)))
    return np.fft.irfft(spectrum, len(values))
