"""Arm and recordings, as a fit by simulation holds them fixed, and what is believed before."""

import itertools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.output_error.coordinates import coordinates
from ident.output_error.plant.arm import simulate
from ident.output_error.plant.servo import Motion
from ident.signals.arrays import Array

MEMORY_S = 0.4
"""Residuals closer than this say the same."""

_AWAY = 1e6  # rad: where a simulation that ran away is taken to be


@dataclass(frozen=True)
class MotionSegment:
    """Unbroken samples of one recording.

    Attributes:
        motion: what was commanded.
        q: what the encoders told [rad], shape (S, n).
        name: of the recording.
        counted: the first sample that errors count; before it the simulation finds its way.
        wrong: samples of the recording that were left out, as no motion reaches them, by joint.
        start_s: time of the first sample since the recording's first [s], where that is asked.
    """

    motion: Motion
    q: Array
    name: str = ""
    counted: int = 0
    wrong: tuple[int, ...] = ()
    start_s: float = 0.0


@dataclass(frozen=True)
class Setup:
    """All that a fit holds fixed.

    Attributes:
        chain, delta: the links.
        at_link: whether each joint's encoder sits behind the gears, shape (n,).
        segments: the recordings.
        step: longest step of the simulation [s].
        resolution: smallest step of the positions [rad], shape (n,); 0: they are exact.
    """

    chain: Chain
    delta: Array
    at_link: NDArray[np.bool_]
    segments: tuple[MotionSegment, ...]
    step: float
    resolution: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def seconds(self) -> float:
        """Length of all recordings."""
        return sum(float(s.motion.t[-1] - s.motion.t[0]) for s in self.segments)

    def replay(self, settings: Array) -> list[Array]:
        """Simulated positions along each segment, shape (S, n) each [rad]."""
        return self._replays([settings])[0]

    def residuals(self, settings: Array) -> Array:
        """Measured less simulated positions, all segments stacked [rad], shape (S, n)."""
        return self.residuals_of([settings])[0]

    def residuals_of(self, some: Sequence[Array]) -> list[Array]:
        """Residuals of several settings."""
        told = [s.q[s.counted :] for s in self.segments]
        counted = [s.counted for s in self.segments]
        return [
            np.concatenate([q - m[k:] for q, m, k in zip(told, made, counted, strict=True)])
            for made in self._replays(some)
        ]

    def _replays(self, some: Sequence[Array]) -> list[list[Array]]:
        """Positions along each segment for each of some settings.

        As many segments are simulated at a time as numba has threads.
        """
        asked = list(itertools.product(some, self.segments))
        if (threads := min(get_num_threads(), len(asked))) < 2:
            made = [self._along(*each) for each in asked]
        else:
            with ThreadPoolExecutor(threads) as pool:
                made = list(pool.map(self._along, *zip(*asked, strict=True)))
        count = len(self.segments)
        return [made[k : k + count] for k in range(0, len(made), count)]

    def _along(self, settings: Array, segment: MotionSegment) -> Array:
        out = np.empty_like(segment.q)
        simulate(self.chain, self.delta, settings, self.at_link, segment.motion, self.step, out)
        return np.clip(np.nan_to_num(out, nan=_AWAY), -_AWAY, _AWAY)


@dataclass(frozen=True)
class Prior:
    """What is believed before the data: where coordinates lie, and how alike joints are.

    Attributes:
        center: settings around which they lie, shape (quantities, n).
        sd: of each coordinate, shape (quantities, n).
        alike: of the difference of a coordinate from its mean over joints, shape (quantities,);
            inf: not.
    """

    center: Array
    sd: Array
    alike: Array

    def pull(self, settings: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Hessian and downhill slope of half the prior's cost, by free coordinate."""
        pairs = np.argwhere(free)
        rows, joints = pairs.T
        away = coordinates(settings)[rows, joints] - coordinates(self.center)[rows, joints]
        hessian = np.diag(self.sd[rows, joints] ** -2.0)
        for row in np.unique(rows):
            mine = rows == row
            count = int(mine.sum())
            if np.isfinite(self.alike[row]) and count > 1:
                spread = (np.eye(count) - 1.0 / count) / self.alike[row] ** 2
                hessian[np.ix_(mine, mine)] += spread
        return hessian, -hessian @ away
