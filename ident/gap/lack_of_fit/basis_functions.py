"""Free curves of position, speed and time: basis functions for a test of lack of fit.

They take no part in naming. If they still explain something once no effect is left to accept, the
gap has no name yet, and the variable that they depend on says where to look.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.effects.effect import FormUncertainty
from ident.effects.observation import Observed
from ident.effects.observing import CurrentModel, observed
from ident.gap.data.windows import body_step
from ident.gap.regression.rows import WindowedRows
from ident.signals.arrays import Array

_KNOTS = 12
_WAVES = 59
_WAVE_NUMBERS = (2.0, 60.0)  # [1/rad]: from a few waves over a joint's range to a motor's ripple
_BEATS_HZ = (0.2, 4.0)  # above the excitation's fundamental, below the windows' cut-off
_FULL_SPEED = 1.5  # [rad/s] at which the hats over speed end


@dataclass(frozen=True)
class Group:
    """Free columns on one joint.

    Attributes:
        name: the variable that the torque would depend on, with {j} for the joint.
        size: number of columns.
        single: only the best of several pairs of columns counts, not all together.
    """

    name: str
    size: int
    single: bool = False


PERIODIC_IN_TIME = Group("time, periodically", 0, single=True)
"""Its columns are formed by `beat_columns`, for the strongest frequency only."""

PERIODIC_IN_ANGLE = Group("the angle of joint {j}, periodically", 2 * _WAVES, single=True)
"""A sine and a cosine for each of the wave numbers."""

GROUPS = (
    Group("the position of joint {j}", _KNOTS),
    Group("the position and direction of joint {j}", _KNOTS),
    Group("the position and speed of joint {j}", _KNOTS),
    Group("the speed of joint {j}, following its direction", _KNOTS),
    Group("the speed of joint {j}, the same in both directions", _KNOTS),
    Group("time since the start of the run", _KNOTS),
    Group("time since the start, following the direction of joint {j}", _KNOTS),
    PERIODIC_IN_ANGLE,
    PERIODIC_IN_TIME,
    Group("the motion of other joints", 0),
)
"""The last group has six columns for each other joint."""


@dataclass(frozen=True)
class Range:
    """Range of the variables of the free curves.

    Attributes:
        low, high: positions of each joint in all recordings [rad], each of shape (n,).
        end_s: length of the longest recording [s].
    """

    low: Array
    high: Array
    end_s: float


class FreeCurves:
    """Decimated observations of all segments, from which free columns are formed."""

    def __init__(self, rows: WindowedRows, model: CurrentModel) -> None:
        whole = np.concatenate([s.q for s in rows.segments])
        last = max(float(s.t[-1]) for s in rows.segments)
        every = body_step(rows.windows)
        self._extent = Range(whole.min(axis=0), whole.max(axis=0), last)
        self._windows = rows.windows.coarser(every)
        self._kept = rows.blocks.kept
        self._seen = [observed(s, model, every)[1] for s in rows.segments]

    def windowed(self, curves: Callable[[Observed, Range], list[Array]]) -> list[Array]:
        """Windowed columns of all rows, each of shape (R, size).

        Args:
            curves: forms the columns of one segment, each of shape (S, size).
        """
        formed = [curves(seen, self._extent) for seen in self._seen]
        return [
            np.concatenate(
                [self._windows.mean(b)[kept] for b, kept in zip(group, self._kept, strict=True)]
            )
            for group in zip(*formed, strict=True)
        ]


def form_columns(
    seen: Observed, extent: Range, joint: int, freedom: FormUncertainty
) -> list[Array]:
    """Curves by which the form of an effect may be wrong, shape (S, size); no column for none."""
    place, fast, late = _over(seen, extent, joint)
    qd, direction = seen.qd[:, [joint]], seen.direction[:, [joint]]
    columns = {
        FormUncertainty.SPEED: fast * direction,
        FormUncertainty.EITHER_WAY: fast,
        FormUncertainty.POSITION: place,
        FormUncertainty.TIME: np.column_stack([late * direction, late * qd]),
    }
    return [columns.get(freedom, np.zeros((len(qd), 0)))]


def _over(seen: Observed, extent: Range, joint: int) -> tuple[Array, Array, Array]:
    """Hats over a joint's position, its speed, and time, each of shape (S, _KNOTS)."""
    low, high = extent.low[joint], extent.high[joint]
    return (
        _hat_functions((seen.q[:, joint] - low) / max(high - low, 1e-9)),
        _hat_functions(np.sqrt(np.minimum(np.abs(seen.qd[:, joint]) / _FULL_SPEED, 1.0))),
        _hat_functions(seen.t / extent.end_s),
    )


def group_columns(seen: Observed, extent: Range, joint: int) -> list[Array]:
    """Columns of each group on a joint, each of shape (S, size)."""
    q, qd, direction = seen.q[:, joint], seen.qd[:, joint], seen.direction[:, joint]
    place, fast, late = _over(seen, extent, joint)
    waves = wave_numbers()
    others = [k for k in range(seen.arm.dof) if k != joint and seen.arm.moving[k]]
    cross = [
        column
        for k in others
        for column in (
            seen.q[:, k],
            seen.qd[:, k],
            seen.qdd[:, k],
            seen.direction[:, k],
            seen.qd[:, k] * qd,
            seen.q[:, k] * q,
        )
    ]
    return [
        place,
        place * direction[:, None],
        place * qd[:, None],
        fast * direction[:, None],
        fast,
        late,
        late * direction[:, None],
        sines(np.outer(q, waves)),
        np.zeros((len(q), 0)),
        np.column_stack(cross) if cross else np.zeros((len(q), 0)),
    ]


def wave_numbers() -> Array:
    """Of the pairs of columns of `PERIODIC_IN_ANGLE` [1/rad]."""
    return np.linspace(*_WAVE_NUMBERS, _WAVES)


def beat_columns(t: Array, rows: NDArray[np.bool_], error: Array) -> tuple[Array, int, float]:
    """Sine and cosine of the strongest frequency, shape (R, 2), of how many, and that one [Hz].

    Args:
        t: time of each row [s], shape (R,).
        rows: those to look at, shape (R,).
        error: their residual.
    """
    beats = 2 * np.pi * np.arange(*_BEATS_HZ, 0.5 / max(float(np.ptp(t)), 1.0))
    power = np.abs(np.exp(-1j * np.outer(beats, t[rows])) @ error)
    strongest = float(beats[power.argmax()])
    return sines(np.outer(t, strongest)), len(beats), strongest / (2 * np.pi)


def _hat_functions(u: Array) -> Array:
    """Piecewise-linear hats over 0 to 1, shape (S, _KNOTS)."""
    centres = np.linspace(0.0, 1.0, _KNOTS)
    return np.maximum(0.0, 1.0 - np.abs(u[:, None] - centres) * (_KNOTS - 1))


def sines(angle: Array) -> Array:
    """Sine and cosine side by side, shape (S, 2 W)."""
    return np.stack([np.sin(angle), np.cos(angle)], axis=-1).reshape(len(angle), -1)
