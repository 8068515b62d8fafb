"""Averages of the equation of motion over short overlapping windows.

A row of the regression is the mean of the equation of motion (2) over a Hann window. Torque and
all columns are averaged alike, so the filter adds no error, and a row depends only on the samples
in its window.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ident.signals.arrays import Array


@dataclass(frozen=True)
class Windows:
    """Hann windows that overlap by half.

    Attributes:
        hop: samples from window to window; each is two hops long.
        rate_hz: of the samples.
    """

    hop: int
    rate_hz: float

    @property
    def cutoff_hz(self) -> float:
        """Frequency at which the mean has a gain of one half (-6 dB) [Hz]."""
        return self.rate_hz / (2 * self.hop)

    def coarser(self, factor: int) -> "Windows":
        """The same windows on decimated samples; `factor` must divide the hop."""
        return Windows(self.hop // factor, self.rate_hz / factor)

    def mean(self, samples: Array) -> Array:
        """Weighted means, shape (R, ...), of samples of shape (S, ...)."""
        blocks = self._blocks(samples)
        rising, falling = _halves(self.hop)
        ahead = np.einsum("rh...,h->r...", blocks[:-1], rising)
        return ahead + np.einsum("rh...,h->r...", blocks[1:], falling)

    def least(self, samples: Array) -> Array:
        """Smallest sample of each window, shape (R, ...)."""
        lowest = self._blocks(samples).min(axis=1)
        return np.minimum(lowest[:-1], lowest[1:])

    def centres(self, t: Array) -> Array:
        """Times of the windows' centres, shape (R,)."""
        count = len(t) // self.hop
        return t[self.hop * np.arange(1, count)]

    def _blocks(self, samples: Array) -> Array:
        count = len(samples) // self.hop
        return samples[: count * self.hop].reshape(count, self.hop, *samples.shape[1:])


@cache
def _halves(hop: int) -> tuple[Array, Array]:
    """The rising and the falling half of a Hann window, which sum to one."""
    u = (np.arange(2 * hop) + 0.5) / (2 * hop)
    hann = np.sin(np.pi * u) ** 2
    hann /= hann.sum()
    return hann[:hop], hann[hop:]


def windows_for(rate_hz: float, cutoff_hz: float) -> Windows:
    """Windows whose mean has about this cut-off; at least two samples to a hop."""
    return Windows(max(2, round(rate_hz / (2 * cutoff_hz))), rate_hz)


# least rate for links that move below 40 Hz: 100 Hz, or what a rate a little off makes of it
_BODY_RATE_HZ = 90.0


def body_step(windows: Windows) -> int:
    """Decimation factor for columns that vary as slowly as the links move.

    It divides the hop, and is odd, so that the centre of each block is a sample.
    """
    most = max(1, int(windows.rate_hz / _BODY_RATE_HZ))
    return next(k for k in range(most, 0, -1) if windows.hop % k == 0 and k % 2 == 1)
