"""Zero-phase Butterworth filtering and differentiation, in the frequency domain.

Run forward and backward, a digital Butterworth filter multiplies the spectrum by the square of its
gain, which has a closed form; the same multiplication differentiates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from ident.signals.arrays import Array

_DECAY = 1e-11


@dataclass(frozen=True)
class Lowpass:
    """A Butterworth low-pass, run forward and backward.

    Attributes:
        cutoff_hz: the single pass lies at -3 dB here, the zero-phase filter at -6 dB.
        order: of the single pass (paper, V-C: three).
        rate_hz: of the samples.
    """

    cutoff_hz: float
    order: int
    rate_hz: float

    def gain(self, frequency_hz: Array) -> Array:
        """Gain of both passes together: |H|^2 of the bilinear design, cut-off prewarped."""
        warped = np.tan(np.pi * np.minimum(frequency_hz / self.rate_hz, 0.5 - 1e-9))
        return 1 / (
            1 + (warped / np.tan(np.pi * self.cutoff_hz / self.rate_hz)) ** (2 * self.order)
        )

    @property
    def time_constant_s(self) -> float:
        """Of the slowest pole [s]."""
        return 1 / (2 * np.pi * self.cutoff_hz * np.sin(np.pi / (2 * self.order)))

    @property
    def memory_s(self) -> float:
        """Time after which an input is forgotten to one part in 10^11 [s]."""
        return float(-np.log(_DECAY) * self.time_constant_s)


@dataclass(frozen=True)
class Spectrum:
    """Spectra of signals on a uniform grid that the transform takes for one period.

    Attributes:
        values: shape (F, ...), time axis first.
        length: number of samples.
        rate_hz: of the samples.
    """

    values: NDArray[np.complex128]
    length: int
    rate_hz: float

    def signal(self, lowpass: Lowpass, derivative: int = 0, every: int = 1) -> Array:
        """The filtered signals, or their derivative, shape (length // every, ...).

        Args:
            lowpass: the filter.
            derivative: how many times to differentiate [1/s each].
            every: keep one sample of this many; must divide `length`.
        """
        frequency = np.fft.rfftfreq(self.length, 1 / self.rate_hz)
        factor = lowpass.gain(frequency) * (2j * np.pi * frequency) ** derivative
        values = self.values * factor.reshape(-1, *[1] * (self.values.ndim - 1))
        count = self.length // every
        return np.fft.irfft(_folded(values, count, every), count, axis=0)


def _folded(values: NDArray[np.complex128], count: int, every: int) -> NDArray[np.complex128]:
    """Spectrum of every so-manieth sample: frequencies beyond the new range fold back into it.

    Cutting them off instead would spread each jump, however faintly, over the whole signal.
    """
    half = count // 2
    result = values[: half + 1].copy()
    for fold in range(1, every // 2 + 1):
        centre = fold * count
        result += values[centre - half : centre + 1][::-1].conj()
        if 2 * fold < every:
            result += values[centre : centre + half + 1]
    return result / every


def delayed(signals: Array, rate_hz: float, seconds: float) -> Array:
    """Signals that come so much later, time axis first: y(t) = x(t - seconds)."""
    frequency = np.fft.rfftfreq(len(signals), 1 / rate_hz)
    turn = np.exp(-2j * np.pi * frequency * seconds).reshape(-1, *[1] * (signals.ndim - 1))
    return np.fft.irfft(np.fft.rfft(signals, axis=0) * turn, len(signals), axis=0)


def spectrum(signals: Array, rate_hz: float) -> Spectrum:
    """The spectra of signals whose time axis is the first."""
    return Spectrum(np.fft.rfft(signals, axis=0), len(signals), rate_hz)


def extended(signals: Array, before: int, after: int) -> Array:
    """Signals continued at both ends by their point reflection, which keeps value and slope.

    Raises:
        ValueError: the signals are too short to be reflected that far.
    """
    if max(before, after) >= len(signals):
        raise ValueError(f"{len(signals)} samples cannot be continued by {max(before, after)}")
    head = 2 * signals[0] - signals[before:0:-1]
    tail = 2 * signals[-1] - signals[-2 : -2 - after : -1] if after else signals[:0]
    return np.concatenate([head, signals, tail])


def fast_length(least: int, multiple: int) -> int:
    """The shortest length that the transform is fast for, and that `multiple` divides."""
    return int(next_fast_len(-(-least // multiple), real=True) or 1) * multiple
