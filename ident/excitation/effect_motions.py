"""A small library of motions, each of which makes one kind of effect visible."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ident.effects.catalogue import catalogue
from ident.effects.effect import ExperimentMotion
from ident.effects.events import EVENTS
from ident.excitation.problem.constraints import Bounds
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Frame:
    """What a motion is built in.

    Attributes:
        bounds: the design's limits.
        pose: a pose that is allowed, shape (n,) [rad].
        out: an allowed pose in which the arm reaches far out, shape (n,) [rad].
        joint: the joint to look at, from 0.
        partner: the joint that shares its motors, or its neighbour, from 0.
    """

    bounds: Bounds
    pose: Array
    out: Array
    joint: int
    partner: int


@dataclass(frozen=True)
class Sketch:
    """A motion before it is brought within its limits.

    Attributes:
        period_s: of its series [s].
        coefficients: shape (2 L + 1, n).
        periods: how many count.
    """

    period_s: float
    coefficients: Array
    periods: int


def slow_reversals(frame: Frame) -> Sketch:
    """One joint turns back again and again, from nearly at rest to a third of its speed."""
    speed = frame.bounds.kinematic[1, frame.joint] / 3
    return _alone(frame, 60.0, {9: speed / 2, 10: speed / 2}, 3)


def speed_staircase(frame: Frame) -> Sketch:
    """One joint goes to and fro at many speeds, up to its fastest."""
    speed = frame.bounds.kinematic[1, frame.joint]
    return _alone(frame, 60.0, {6: speed / 3, 7: speed / 3, 8: speed / 3}, 3)


def fast_reversals(frame: Frame) -> Sketch:
    """One joint shakes as hard as its acceleration allows, at several frequencies."""
    strength = frame.bounds.kinematic[2, frame.joint]
    omega = 2 * np.pi / 10.0
    shares = {k: strength / (3 * k * omega) for k in (4, 7, 10)}
    return _alone(frame, 10.0, shares, 6)


def wide_sweep(frame: Frame) -> Sketch:
    """One joint goes slowly through its whole range and back."""
    half = frame.bounds.kinematic[0, frame.joint]
    omega = 2 * np.pi / 40.0
    return _alone(frame, 40.0, {1: half * omega, 3: half * omega / 4}, 3)


def load_changes(
    frame: Frame,
    period_s: float = 40.0,
    reversals: tuple[int, int] = (8, 9),
    periods: int = 3,
) -> Sketch:
    """One joint keeps reversing while the others carry it through light and heavy poses.

    Args:
        frame: what it is built in.
        period_s: of the series [s].
        reversals: harmonics of the joint's own motion.
        periods: how many count.
    """
    bounds, omega = frame.bounds, 2 * np.pi / period_s
    coefficients = np.zeros((2 * max(reversals) + 3, len(frame.pose)))
    coefficients[-1] = bounds.middle
    for k in range(len(frame.pose)):
        coefficients[k % 2, k] = bounds.kinematic[0, k] * omega * (1 + k % 2)
    coefficients[:-1, frame.joint] = 0.0
    coefficients[np.array(reversals) - 1, frame.joint] = bounds.kinematic[1, frame.joint] / 4
    return Sketch(period_s, coefficients, periods)


def stretched_sweep(frame: Frame) -> Sketch:
    """The first joint sweeps its range with the arm stretched out."""
    half, omega = frame.bounds.kinematic[0, 0], 2 * np.pi / 30.0
    coefficients = np.zeros((7, len(frame.pose)))
    coefficients[-1] = frame.out
    coefficients[-1, 0] = frame.bounds.middle[0]
    coefficients[0, 0] = half * omega
    return Sketch(30.0, coefficients, 3)


def changing_dominance(frame: Frame) -> Sketch:
    """Two joints of a differential move at once; now one is faster, now the other."""
    sketch = _alone(frame, 40.0, {7: 0.0, 9: 0.0}, 3)
    harmonics = len(sketch.coefficients) // 2
    for joint, sign in ((frame.joint, 1.0), (frame.partner, -1.0)):
        speed = frame.bounds.kinematic[1, joint]
        column = sketch.coefficients[:, joint]
        row = 0 if sign > 0 else harmonics
        column[row + 7] = speed / 2
        column[[row + 6, row + 8]] = sign * speed / 4
    return sketch


def _alone(frame: Frame, period_s: float, speeds: Mapping[int, float], periods: int) -> Sketch:
    """One joint moves and the others rest; `speeds` [rad/s] by harmonic."""
    harmonics = max(speeds)
    coefficients = np.zeros((2 * harmonics + 1, len(frame.pose)))
    coefficients[-1] = frame.pose
    for harmonic, speed in speeds.items():
        coefficients[harmonic - 1, frame.joint] = speed
    return Sketch(period_s, coefficients, periods)


MOTIONS: dict[ExperimentMotion, Callable[[Frame], Sketch]] = {
    ExperimentMotion.SLOW_REVERSALS: slow_reversals,
    ExperimentMotion.SPEED_STAIRCASE: speed_staircase,
    ExperimentMotion.FAST_REVERSALS: fast_reversals,
    ExperimentMotion.WIDE_SWEEP: wide_sweep,
    ExperimentMotion.LOAD_CHANGES: load_changes,
    ExperimentMotion.STRETCHED_SWEEP: stretched_sweep,
    ExperimentMotion.CHANGING_DOMINANCE: changing_dominance,
}
"""The library; what is not here wants the excitation itself repeated."""


def motion_for(effect: str) -> Callable[[Frame], Sketch] | None:
    """The motion that shows an effect or event; None: the excitation, repeated for a long time."""
    if effect in EVENTS:
        return None
    return MOTIONS.get(catalogue()[effect].motion)
