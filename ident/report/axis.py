"""Axes: from values to places on the page, with ticks at round numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.report.words import number

Array = NDArray[np.floating]

_ROUND = np.array([1.0, 2.0, 2.5, 5.0, 10.0])


@dataclass(frozen=True)
class Axis:
    """One direction of a plot.

    Attributes:
        label: quantity with its unit, `torque [N·m]`.
        low, high: values at its ends.
        start, end: places of its ends [px].
        ticks: values with a mark.
        logarithmic: whether equal steps are equal factors.
    """

    label: str
    low: float
    high: float
    start: float
    end: float
    ticks: tuple[float, ...]
    logarithmic: bool = False

    def place(self, values: Array | float) -> Array:
        """Where values lie [px]."""
        v, low, high = np.asarray(values, dtype=float), self.low, self.high
        if self.logarithmic:
            v, low, high = np.log10(np.maximum(v, low)), np.log10(low), np.log10(high)
        return self.start + (v - low) / (high - low) * (self.end - self.start)

    def at(self, value: float) -> float:
        """Where one value lies [px]."""
        return float(self.place(value))

    @property
    def labels(self) -> list[str]:
        """The ticks in print, all with the same number of decimals."""
        if self.logarithmic:
            return [number(t, 1) for t in self.ticks]
        step = min(np.diff(self.ticks)) if len(self.ticks) > 1 else 1.0
        places = max(0, -int(np.floor(np.log10(step) + 1e-9)))
        places += round(step * 10**places, 6) % 1 != 0
        return [f"{t:.{places}f}".replace("-", "−") for t in self.ticks]


def linear_axis(
    label: str,
    values: Sequence[Array],
    place: tuple[float, float],
    most: int = 5,
    zero: bool = False,
) -> Axis:
    """An axis that holds all values, its ends at ticks.

    Args:
        label: quantity with its unit.
        values: what is to fit on it; not-a-numbers are passed over.
        place: its ends [px].
        most: about this many ticks.
        zero: whether it must hold zero.
    """
    low, high = _extent(values)
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        low, high = low - 1.0, high + 1.0
    step = _step((high - low) / most)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    ticks = step * np.arange(first, last + 1)
    return Axis(label, float(ticks[0]), float(ticks[-1]), *place, tuple(map(float, ticks + 0.0)))


def time_axis(label: str, values: Array, place: tuple[float, float], most: int = 6) -> Axis:
    """An axis that ends where the values end."""
    low, high = _extent([values])
    high = high if high > low else low + 1.0
    step = _step((high - low) / most)
    ticks = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    return Axis(label, low, high, *place, tuple(map(float, ticks + 0.0)))


def logarithmic_axis(label: str, values: Sequence[Array], place: tuple[float, float]) -> Axis:
    """An axis of factors, for positive values.

    Its ticks are at 1, 2, 5, and 10, or at powers of ten where these are many.
    """
    positive = [np.asarray(v)[np.asarray(v) > 0] for v in values]
    low, high = _extent(positive)
    low, high = (low, high) if high > 0 and low > 0 else (0.1, 1.0)
    decades = range(int(np.floor(np.log10(low))) - 1, int(np.ceil(np.log10(high))) + 2)
    steps = (1.0, 2.0, 5.0) if np.log10(high / low) < 3 else (1.0,)
    every = np.array([s * 10.0**d for d in decades for s in steps])
    below, above = every[every <= low * 1.001].max(), every[every >= high * 0.999].min()
    above = above if above > below else every[every > below].min()
    ticks = every[(every >= below * 0.999) & (every <= above * 1.001)]
    return Axis(label, float(below), float(above), *place, tuple(map(float, ticks)), True)


def _extent(values: Sequence[Array]) -> tuple[float, float]:
    flat = np.concatenate([np.ravel(np.asarray(v, dtype=float)) for v in values])
    flat = flat[np.isfinite(flat)]
    return (float(flat.min()), float(flat.max())) if len(flat) else (0.0, 1.0)


def _step(least: float) -> float:
    power = 10.0 ** np.floor(np.log10(least))
    return float(power * _ROUND[np.argmax(_ROUND * power >= least * 0.999)])
