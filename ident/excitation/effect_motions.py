"""A small library of motions, each of which makes one kind of effect visible, and of probes.

Probes are short motions that search a joint's range of speeds, accelerations, positions and loads.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ident.effects.catalogue import catalogue
from ident.effects.effect import ExperimentMotion
from ident.effects.events import EVENTS
from ident.excitation.problem.constraints import Bounds
from ident.signals.arrays import Array

PERIOD_S = 12.0
"""Of a probe, so that its first run at a quarter of its speed is short, too."""

_OMEGA = 2 * np.pi / PERIOD_S
_HARMONICS = 5
_DRIFT = 0.12  # of its fastest speed, of a joint that another one's probe carries along


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


def slow(frame: Frame) -> Sketch:
    """One joint turns back again and again, at up to a quarter of its speed, and nearly dwells."""
    return _probe(frame, {2: 0.12, 3: 0.12})


def brisk(frame: Frame) -> Sketch:
    """One joint goes to and fro at all its speeds, both ways."""
    return _probe(frame, {1: 0.3, 2: 0.4, 3: 0.3})


def shaken(frame: Frame) -> Sketch:
    """One joint turns back as hard as its acceleration allows."""
    strength = frame.bounds.kinematic[2, frame.joint] / frame.bounds.kinematic[1, frame.joint]
    return _probe(frame, {k: strength / (3 * k * _OMEGA) for k in (3, 5, 8)})


def swept(frame: Frame) -> Sketch:
    """One joint goes through its whole range and back."""
    reach = frame.bounds.kinematic[0, frame.joint] * _OMEGA
    return _probe(frame, {1: reach / frame.bounds.kinematic[1, frame.joint]})


def loaded(frame: Frame) -> Sketch:
    """One joint keeps turning back while the others carry it through light and heavy poses."""
    return load_changes(frame, PERIOD_S, (3, 4), 1)


def paired(frame: Frame) -> Sketch:
    """A joint and the one that shares its motors move at once; now one is faster, now the other."""
    sketch = _probe(frame, {3: 0.5, 4: 0.25})
    speed = frame.bounds.kinematic[1, frame.partner]
    sketch.coefficients[[_HARMONICS + 2, _HARMONICS + 1], frame.partner] = speed / 2, -speed / 4
    return sketch


def scattered(frame: Frame, seed: int) -> Sketch:
    """All joints move, each as fast as its limits allow, along random curves."""
    rng = np.random.default_rng(seed)
    coefficients = np.zeros((2 * _HARMONICS + 1, len(frame.pose)))
    coefficients[:-1] = rng.normal(size=(2 * _HARMONICS, len(frame.pose)))
    coefficients[-1] = frame.bounds.middle
    return Sketch(PERIOD_S, coefficients, 1)


def _probe(frame: Frame, shares: dict[int, float]) -> Sketch:
    """One joint moves, `shares` of its fastest speed by harmonic; the others drift.

    A joint that ought to rest is pushed about and sticks, which looks like contacts.
    """
    fastest, harmonics = frame.bounds.kinematic[1], max(_HARMONICS, *shares)
    speeds = {k: share * fastest[frame.joint] for k, share in shares.items()}
    sketch = _alone(frame, PERIOD_S, {harmonics: 0.0} | speeds, 1)
    for k in set(range(len(frame.pose))) - {frame.joint}:
        sketch.coefficients[k % 2, k] = _DRIFT * fastest[k] / 2
        sketch.coefficients[harmonics + (k + 1) % 3, k] = _DRIFT * fastest[k]
    return sketch


PROBES: dict[str, Callable[[Frame], Sketch]] = {
    f.__name__: f for f in (slow, brisk, shaken, swept, loaded, paired)
}
"""The probes of one joint, by name."""
