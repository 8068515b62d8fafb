"""Torques that hang on one joint's speed alone: what friction and yielding dampers can hold."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.export.linear_torque import acting
from ident.signals.arrays import Array
from ident.simulation.arm import Term

_PROBES = 20
_ROUNDING = 1e-9
_GRID = 4000
_SLOWEST = 1e-5  # of the speeds that are held
_EXACT = 0.002  # of the largest torque: what straight pieces may be off


@dataclass(frozen=True)
class YieldingDamper:
    """A torque bias + slope qd, kept between two bounds, which the drives must overcome.

    Attributes:
        bias: [N m].
        slope: [N m s/rad].
        lower, upper: [N m].
    """

    bias: float
    slope: float
    lower: float
    upper: float


@dataclass(frozen=True)
class SpeedTorque:
    """Torque of one joint that its speed alone tells.

    Attributes:
        terms: of the joint, of `hangs_on_speed`.
        joint: from 0.
        n: number of joints.
        dry: friction at rest [N m]: the torque's step there is twice this.
    """

    terms: tuple[Term, ...]
    joint: int
    n: int
    dry: float

    def at(self, qd: Array) -> Array:
        """What the drives must overcome beside the dry friction at speeds [rad/s], shape (S,)."""
        rest, speeds = np.zeros(self.n), np.outer(qd, np.eye(self.n)[self.joint])
        found = [
            _torque(term, 0.0, rest, v, rest)[self.joint] for term in self.terms for v in speeds
        ]
        return np.reshape(found, (len(self.terms), -1)).sum(axis=0) - self.dry * np.sign(qd)


def hangs_on_speed(term: Term, n: int) -> bool:
    """Whether a term is a torque of its joint's speed alone, with no more than friction at rest."""
    j, rng = term.joint, np.random.default_rng(0)
    rest = np.zeros(n)
    for q, qd, load in rng.uniform(-3.0, 3.0, size=(_PROBES, 3, n)):
        expected = _torque(term, 0.0, rest, np.where(np.arange(n) == j, qd, 0.0), rest)
        found = _torque(term, 7.0, q, qd, load)
        if np.delete(found, j).any() or not np.allclose(found, expected, _ROUNDING, _ROUNDING):
            return False
    resistance, level = acting(term, 0.0, rest, rest, rest)
    return not resistance.any() and level[j] >= 0.0


def speed_torque(terms: Sequence[Term], joint: int, n: int) -> SpeedTorque:
    """The sum of those terms of a joint that hang on its speed alone.

    Args:
        terms: of the joint; others than `hangs_on_speed` are passed over.
        joint: from 0.
        n: number of joints.
    """
    rest = np.zeros(n)
    own = tuple(term for term in terms if hangs_on_speed(term, n))
    dry = sum(float(acting(term, 0.0, rest, rest, rest)[1][joint]) for term in own)
    return SpeedTorque(own, joint, n, dry)


def yielding_dampers(torque: SpeedTorque, fastest: float) -> list[YieldingDamper]:
    """A torque without its dry friction, in straight pieces within 0.2 % of its largest.

    Beyond twice the fastest speed it stays what it is there.

    Args:
        torque: of one joint.
        fastest: the joint's limit of speed [rad/s].
    """
    if not torque.terms:
        return []
    speeds = np.append(0.0, 2 * fastest * np.geomspace(_SLOWEST, 1.0, _GRID))
    forward, backward = torque.at(speeds), torque.at(-speeds)
    within = np.abs([forward, backward])[:, speeds <= fastest]
    tolerance = _EXACT * float(within.max())
    if np.allclose(forward, -backward, rtol=0.0, atol=_ROUNDING):
        return _both_ways(speeds, forward, tolerance)
    ahead = _one_way(speeds, forward, tolerance)
    back = _one_way(speeds, backward, tolerance)
    return ahead + [YieldingDamper(x.bias, -x.slope, x.lower, x.upper) for x in back]


def falls_with_speed(dampers: Sequence[YieldingDamper], damping: float) -> bool:
    """Whether dampers and a joint's own damping [N m s/rad] together push where it speeds up."""
    ends = [(b - x.bias) / x.slope for x in dampers for b in (x.lower, x.upper)]
    speeds = np.unique(ends)
    torque = damping * speeds
    for x in dampers:
        torque += np.clip(x.bias + x.slope * speeds, x.lower, x.upper)
    return bool((np.diff(torque) < 0.0).any())


def _both_ways(speeds: Array, torque: Array, tolerance: float) -> list[YieldingDamper]:
    """Dampers that yield at the ends of the pieces, for a torque that turns with the speed."""
    ends = speeds[_corners(speeds, torque, tolerance)]
    slopes = np.diff(np.interp(ends, speeds, torque)) / np.diff(ends)
    changes = slopes - np.append(slopes[1:], 0.0)
    most = np.abs(changes) * ends[1:]
    pieces = zip(changes, most, strict=True)
    return [YieldingDamper(0.0, float(k), -float(m), float(m)) for k, m in pieces if m > 0.0]


def _one_way(speeds: Array, torque: Array, tolerance: float) -> list[YieldingDamper]:
    """A damper for each piece, which rises or falls along it and rests before and after."""
    ends = speeds[_corners(speeds, torque, tolerance)]
    rises = np.diff(np.interp(ends, speeds, torque))
    slopes = rises / np.diff(ends)
    return [
        YieldingDamper(float(-k * v), float(k), min(0.0, float(r)), max(0.0, float(r)))
        for k, v, r in zip(slopes, ends, rises, strict=False)
        if r
    ]


def _corners(x: Array, y: Array, tolerance: float) -> list[int]:
    """Samples between which straight lines are off by no more than a tolerance.

    Source: Ramer 1972; Douglas, Peucker 1973.
    """
    found, open_pieces = {0, len(x) - 1}, [(0, len(x) - 1)]
    while open_pieces:
        first, last = open_pieces.pop()
        line = np.interp(x[first : last + 1], x[[first, last]], y[[first, last]])
        off = np.abs(y[first : last + 1] - line)
        worst = first + int(np.argmax(off))
        if off.max() > tolerance:
            found.add(worst)
            open_pieces += [(first, worst), (worst, last)]
    return sorted(found)


def _torque(term: Term, t: float, q: Array, qd: Array, load: Array) -> Array:
    """Torque of a term at one sample [N m], shape (n,): its friction follows the speed's sign."""
    resistance, level = acting(term, t, q, qd, load)
    return resistance + level * np.sign(qd)
