"""How dry friction turns round: a mixture of curves, which the data choose joint by joint.

Every odd curve of velocity that rises ever slower to its end is a mixture of ramps, and every such
curve of the distance since the reversal a mixture of elements that stretch and then slip (Iwan
1966, eq. (3)). No mixture rises above its end: what does is another effect. Arctangents stand for
curves that never quite end: as wide ramps could be any drag that rises ever slower, there are none.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from ident.effects.bristle import stretch
from ident.effects.smoothed_segment import DIRECTION_HZ
from ident.model.fit_filter import ReversalPart
from ident.signals.arrays import Array

_WIDTHS = (0.001, 0.002, 0.003, 0.0045, 0.0065, 0.009, 0.013, 0.018, 0.026, 0.035)
_TAILED = (0.001, 0.002, 0.004, 0.008, 0.016, 0.022)
_LONG_TAIL = 0.01
_DISTANCES = (1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3)
_USUAL_WIDTH = 0.0065
_NARROW = 0.0045  # [rad/s]: for other speeds, where the joint itself turns round by distance only
_NEARLY_ALL = 0.9
_TIE = 1e-7  # of a curve's own square: beyond what rounding makes of alike curves


@dataclass(frozen=True)
class SmoothedSign:
    """A smoothed sign of the velocity.

    Attributes:
        scale: width [rad/s], or distance [rad] where `cutoff` is None.
        cutoff: which of the velocities of `DIRECTION_HZ` it follows; None: the distance.
        tailed: whether it is an arctangent, not a ramp.
    """

    scale: float
    cutoff: int | None
    tailed: bool = False

    def __call__(self, q: Array, speeds: Array) -> Array:
        """Values between -1 and 1, shape (S,).

        Args:
            q: position of a joint [rad], shape (S,).
            speeds: its velocity by each cut-off [rad/s], shape (C, S).
        """
        if self.cutoff is None:
            return stretch(q, self.scale, True)
        return self.along(speeds[self.cutoff])

    def along(self, speed: Array) -> Array:
        """The same for a speed [rad/s], shape (S,)."""
        if self.tailed:
            return np.arctan(speed / self.scale) * 2.0 / np.pi
        return np.clip(speed / self.scale, -1.0, 1.0)

    def turned(self, speed: float) -> float:
        """Part of it, as a mixture of ramps, that ends below a speed [rad/s]."""
        if self.cutoff is None:
            return 1.0
        if self.tailed:
            x = speed / self.scale
            return float(np.arctan(x) - x / (1.0 + x**2)) * 2.0 / np.pi
        return float(self.scale <= speed)


BASIS = (
    *(SmoothedSign(w, c) for c in range(len(DIRECTION_HZ)) for w in _WIDTHS),
    *(SmoothedSign(w, 1, True) for w in _TAILED),
    *(SmoothedSign(d, None) for d in _DISTANCES),
)
"""What is mixed."""

ENDING = np.array([not t.tailed or t.scale < _LONG_TAIL for t in BASIS])
"""Those without a long tail: it would make up for the form of any effect over the speed."""

USUAL = np.array([float(t == SmoothedSign(_USUAL_WIDTH, 1)) for t in BASIS])
"""Where the choice begins."""


def curve_of(part: ReversalPart) -> SmoothedSign:
    """The curve of a part that a model keeps."""
    if part.cutoff_hz is None:
        return SmoothedSign(part.scale, None)
    nearest = int(np.abs(np.array(DIRECTION_HZ) - part.cutoff_hz).argmin())
    return SmoothedSign(part.scale, nearest, part.tailed)


def shapes_of(reversals: Sequence[Sequence[ReversalPart]], n: int) -> Array:
    """Parts of the curves in `BASIS` that a model keeps, shape (n, T).

    Args:
        reversals: of each joint; where there are none, friction turns round in the usual way.
        n: number of joints.
    """
    shapes = np.zeros((n, len(BASIS)))
    for row, joint in zip(shapes, reversals, strict=False):
        for part in joint:
            curve = curve_of(part)
            row += part.part * np.array([curve == other for other in BASIS])
    return np.array([row / row.sum() if row.any() else USUAL for row in shapes])


@dataclass(frozen=True)
class MaxwellSlipMixture:
    """Parts of the curves in `BASIS`, shape (T,), which sum to one."""

    parts: Array

    def __call__(self, q: Array, speeds: Array) -> Array:
        """Values between -1 and 1, shape (S,); arguments as of `SmoothedSign`."""
        used = [(p, t) for p, t in zip(self.parts, BASIS, strict=True) if p > 0.0]
        return np.sum([p * t(q, speeds) for p, t in used], axis=0)

    @property
    def of_speed(self) -> list[tuple[float, SmoothedSign]]:
        """The parts that follow velocity."""
        used = [(float(p), t) for p, t in zip(self.parts, BASIS, strict=True) if p > 0.0]
        return [x for x in used if x[1].cutoff is not None]

    @property
    def cutoff(self) -> int:
        """The velocity that most of it follows."""
        by_cutoff = np.zeros(len(DIRECTION_HZ))
        for part, turning in self.of_speed:
            by_cutoff[turning.cutoff] += part
        return int(by_cutoff.argmax()) if by_cutoff.any() else 1

    @property
    def width(self) -> float:
        """Speed at which nearly all of it has turned [rad/s]."""
        used = [(p, t) for p, t in zip(self.parts, BASIS, strict=True) if p > 0.0]
        for speed in (0.0, *_WIDTHS):
            if sum(p * t.turned(speed) for p, t in used) >= _NEARLY_ALL:
                return speed
        return _WIDTHS[-1]

    def along(self, speed: Array) -> Array:
        """The smoothed sign of another speed [rad/s], shape (S,)."""
        turnings = self.of_speed or [(1.0, SmoothedSign(_NARROW, 1))]
        total = sum(p for p, _ in turnings)
        return np.sum([p / total * t.along(speed) for p, t in turnings], axis=0)


def best_mixture(
    products: Array, right: Array, usable: NDArray[np.bool_] | None = None
) -> tuple[Array, float]:
    """The weights, none below zero, that explain most, and half the drop of the squares.

    Args:
        products: inner products of all curves, shape (T, T).
        right: with the torque, shape (T,).
        usable: the curves that may be mixed, shape (T,); None: all.
    """
    if usable is not None:
        products, right = products * usable * usable[:, None], right * usable
    square = np.diag(products)
    scale = np.sqrt(np.where(square > 0.0, square, np.inf))
    scaled = products / scale[:, None] / scale
    lengths, axes = np.linalg.eigh(scaled)
    roots = np.sqrt(np.maximum(lengths, _TIE))
    target = (axes.T @ (right / scale)) / roots
    weights = scipy.optimize.nnls(roots[:, None] * axes.T, target)[0] / scale
    return weights, float(right @ weights) / 2


def parts_of(weights: Array, otherwise: Array) -> Array:
    """Weights as parts of one, shape (T,); `otherwise` where there are none."""
    total = float(weights.sum())
    return weights / total if total > 0.0 else otherwise


SLOW = (0.02, 0.12)
"""Speeds below which a joint counts as turning [rad/s]: least, and most (wide friction curves)."""


_WIDTHS_TO_CLEAR = 1.5


def reversal_speed(width: float) -> float:
    """Speed below which a joint counts as turning [rad/s].

    Args:
        width: speed at which its friction has turned [rad/s].
    """
    return float(np.clip(_WIDTHS_TO_CLEAR * width, *SLOW))
