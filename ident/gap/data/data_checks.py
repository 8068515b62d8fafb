"""Faults of the data that nothing mends: skipped samples, torque of the wrong sign or unit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of, torques
from ident.effects.catalogue import torque_scale_effect
from ident.effects.events import DROPPED_SAMPLES
from ident.gap.data.experiment import Experiment
from ident.gap.data_settings import DataChecks
from ident.signals.arrays import Array
from wamctl.arm.robot import cad_parameters

_ROUNDING = 1e-9  # rad: two motors' counts that cancel leave no more
_MODEL_RATE_HZ = 20.0  # the CAD model is compared at this rate
_USUAL_FACTOR = 1.5  # from the median of an absolute error to its standard deviation


@dataclass(frozen=True)
class Fault:
    """A fault of the data.

    Attributes:
        name: id of the effect that it is reported as.
        joints: affected joints, from 0; empty for all.
        text: the fault in a sentence.
        count: number of faulty samples, or the torque's scale.
    """

    name: str
    joints: tuple[int, ...]
    text: str
    count: float


def data_faults(source: Experiment, checks: DataChecks) -> list[Fault]:
    """Faults of some recordings that are left once the checks have mended what can be mended.

    Holes are cut out and repeated samples replaced before (`ident.checks`), and signs and units of
    all joints are turned; what is left here makes every effect doubtful.
    """
    found = []
    for data in source.datasets:
        for segment in data.segments:
            found += _samples(segment.q[:, source.moving], data.name, checks)
    return found + _channels(source, checks)


def _few(count: int, steps: int, checks: DataChecks) -> bool:
    return count < max(checks.min_fault_count, checks.min_fault_share * steps)


def _samples(q: Array, name: str, checks: DataChecks) -> list[Fault]:
    """Positions that repeat, or move by two samples' distance, on all joints at once."""
    step = np.diff(q, axis=0)
    if len(step) < checks.min_steps:
        return []
    before, after = step[:-4], step[4:]
    expected = 0.25 * (before + step[1:-3] + step[3:-1] + after)
    here = step[2:-2]
    least = np.maximum(
        [_smallest(s, checks.step_quantile) for s in step.T], _usual(here - expected)
    )
    fast = np.abs(expected) > checks.fast_steps * np.maximum(least, _ROUNDING)
    ratio = here / np.where(fast, expected, np.inf)
    enough = fast.sum(axis=1) >= 2
    repeated = int((enough & (~fast | (np.abs(ratio) < checks.repeated_step)).all(axis=1)).sum())
    jumps = enough & (~fast | (ratio > checks.skipped_step)).all(axis=1)
    skipped = int(jumps.sum())
    if skipped:
        gained = _way_gained(q, np.flatnonzero(jumps) + 2, checks.jitter_steps)
        skipped = skipped if gained >= checks.min_way_gained else 0
    if repeated < checks.min_repeated_share * len(step):
        repeated = 0
    if _few(repeated + skipped, len(step), checks):
        return []
    text = (
        f"{name}: {repeated} samples repeat the one before, and {skipped} times a sample is lost,"
        " on all moving joints at once, although the stamps are even."
    )
    return [Fault(DROPPED_SAMPLES.id, (), text, repeated + skipped)]


def _way_gained(q: Array, places: NDArray[np.intp], beside: int) -> float:
    """Way that a jump adds to the motion around it, in usual steps: mean over all jumps [1].

    One where a sample is lost, since all that follows comes a step early. None where the clock
    only jitters: the steps beside it are then shorter.

    Args:
        q: position [rad], shape (S, m).
        places: of the sample ahead of each jump.
        beside: so many steps before and after it are around it.
    """
    inside = places[(places >= beside) & (places < len(q) - beside)]
    if len(inside) == 0:
        return 0.0
    steps = np.diff(q, axis=0)
    around = steps[inside[:, None] + np.arange(-beside, beside)]
    usual = np.median(around, axis=1)
    way = around.sum(axis=1) - 2 * beside * usual
    weight = np.abs(usual)
    return float((np.sign(usual) * way).sum() / max(float(weight.sum()), _ROUNDING))


def _smallest(step: Array, quantile: float) -> float:
    """Smallest move of a joint from sample to sample [rad]: the encoder's step."""
    moved = np.abs(step[np.abs(step) > _ROUNDING])
    return float(np.quantile(moved, quantile)) if len(moved) else 1.0


def _usual(error: Array) -> Array:
    """Robust size of each joint's errors [rad], shape (n,)."""
    if len(error) == 0:
        return np.zeros(error.shape[1])
    return _USUAL_FACTOR * np.median(np.abs(error), axis=0)


def _channels(source: Experiment, checks: DataChecks) -> list[Fault]:
    """Sign and unit of the torque, against the CAD model and the dissipation by friction."""
    robot = source.arm.robot
    chain, delta = chain_of(robot), cad_parameters(robot)
    model, torque, power = [], [], []
    for data in source.datasets:
        for segment in data.segments:
            every = max(1, round(data.rate_hz / _MODEL_RATE_HZ))
            q = np.ascontiguousarray(segment.q[::every])
            tau = segment.tau[::every]
            speed = np.gradient(q, every / data.rate_hz, axis=0)
            rate = np.gradient(speed, every / data.rate_hz, axis=0)
            model.append(torques(chain, delta, q, speed, rate))
            torque.append(tau)
            power.append(tau * speed)
    both = np.concatenate(model), np.concatenate(torque)
    found, scales = _signs(source, both, np.concatenate(power), checks)
    return found or _scale(scales, checks)


def _signs(
    source: Experiment, both: tuple[Array, Array], power: Array, checks: DataChecks
) -> tuple[list[Fault], list[float]]:
    """Joints whose torque has the wrong sign, and the scale of each joint that shows it.

    Args:
        source: arm and recordings.
        both: torque of the CAD model and of the recordings [N m], each of shape (S, n).
        power: of the joints [W], shape (S, n).
        checks: the settings.
    """
    found: list[Fault] = []
    scales: list[float] = []
    for j in np.flatnonzero(source.moving):
        model, torque, work = both[0][:, j], both[1][:, j], power[:, j]
        size = float(np.linalg.norm(model) * np.linalg.norm(torque))
        if size == 0.0:
            continue
        inner = float(model @ torque)
        error = work.std() / np.sqrt(max(len(work) / checks.correlated_rows, 1.0))
        driven = work.mean() < -checks.dissipation_z * error
        if inner / size < -checks.clear_correlation or (
            driven and inner / size < checks.weak_correlation
        ):
            text = f"The torque of joint {j + 1} has the wrong sign: it takes energy from friction."
            found.append(Fault(torque_scale_effect().id, (int(j),), text, -1.0))
        elif inner / size > checks.clear_correlation:
            scales.append(inner / float(model @ model))
    return found, scales


def _scale(scales: list[float], checks: DataChecks) -> list[Fault]:
    """A torque in another unit."""
    scale = float(np.median(scales)) if scales else 1.0
    if checks.min_torque_scale < scale < checks.max_torque_scale:
        return []
    text = (
        f"The torque is {scale:.3g} times what the arm's own weight requires: its unit is"
        " wrong; give joint torque in N m."
    )
    return [Fault(torque_scale_effect().id, (), text, scale)]
