"""How dry friction turns round: a mixture of curves, which the data choose joint by joint.

Every odd curve of velocity that rises ever slower to its end is a mixture of ramps, and every such
curve of the distance since the reversal a mixture of elements that stretch and then slip (Iwan
1966, eq. (3)). No mixture rises above its end: what does is another effect.
"""

from dataclasses import dataclass

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from ident.effects.presliding import stretch
from ident.gap.stretch import DIRECTION_HZ

Array = NDArray[np.floating]

_WIDTHS = (0.001, 0.002, 0.003, 0.0045, 0.0065, 0.009, 0.013, 0.018, 0.026, 0.035)
_DISTANCES = (1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3)
_USUAL_WIDTH = 0.0065
_NARROW = 0.0045  # [rad/s]: for other speeds, where the joint itself turns round by distance only
_NEARLY_ALL = 0.9
_TIE = 1e-7  # of a curve's own square: beyond what rounding makes of alike curves


@dataclass(frozen=True)
class Turning:
    """A smoothed sign of the velocity.

    Attributes:
        scale: width [rad/s], or distance [rad] where `cutoff` is None.
        cutoff: which of the velocities of `DIRECTION_HZ` it follows; None: the distance.
    """

    scale: float
    cutoff: int | None

    def __call__(self, q: Array, speeds: Array) -> Array:
        """Values between -1 and 1, shape (S,).

        Args:
            q: position of a joint [rad], shape (S,).
            speeds: its velocity by each cut-off [rad/s], shape (C, S).
        """
        if self.cutoff is None:
            return stretch(np.ascontiguousarray(q), self.scale, True)
        return np.clip(speeds[self.cutoff] / self.scale, -1.0, 1.0)


TURNINGS = (
    *(Turning(w, c) for c in range(len(DIRECTION_HZ)) for w in _WIDTHS),
    *(Turning(d, None) for d in _DISTANCES),
)
"""What is mixed."""

USUAL = np.array([float(t == Turning(_USUAL_WIDTH, 1)) for t in TURNINGS])
"""Where the choice begins."""


@dataclass(frozen=True)
class Mixture:
    """Parts of the curves in `TURNINGS`, shape (T,), which sum to one."""

    parts: Array

    def __call__(self, q: Array, speeds: Array) -> Array:
        """Values between -1 and 1, shape (S,); arguments as of `Turning`."""
        used = [(p, t) for p, t in zip(self.parts, TURNINGS, strict=True) if p > 0.0]
        return np.sum([p * t(q, speeds) for p, t in used], axis=0)

    @property
    def ramps(self) -> list[tuple[float, Turning]]:
        """The parts that follow velocity, narrowest first."""
        used = [(float(p), t) for p, t in zip(self.parts, TURNINGS, strict=True) if p > 0.0]
        return sorted((x for x in used if x[1].cutoff is not None), key=lambda x: x[1].scale)

    @property
    def cutoff(self) -> int:
        """The velocity that most of it follows."""
        by_cutoff = np.zeros(len(DIRECTION_HZ))
        for part, turning in self.ramps:
            by_cutoff[turning.cutoff] += part
        return int(by_cutoff.argmax()) if by_cutoff.any() else 1

    @property
    def width(self) -> float:
        """Speed at which nearly all of it has turned [rad/s]."""
        done = 1.0 - sum(p for p, _ in self.ramps)
        for part, turning in self.ramps:
            done += part
            if done >= _NEARLY_ALL:
                return turning.scale
        return 0.0

    def along(self, speed: Array) -> Array:
        """The smoothed sign of another speed [rad/s], shape (S,)."""
        ramps = self.ramps or [(1.0, Turning(_NARROW, 1))]
        total = sum(p for p, _ in ramps)
        return np.sum([p / total * np.clip(speed / t.scale, -1, 1) for p, t in ramps], axis=0)


def best_mixture(products: Array, right: Array) -> tuple[Array, float]:
    """The weights, none below zero, that explain most, and half the drop of the squares.

    Args:
        products: inner products of all curves, shape (T, T).
        right: with the torque, shape (T,).
    """
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
