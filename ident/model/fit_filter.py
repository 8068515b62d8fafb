"""How the recordings of a fit were filtered, and motion through the same filter."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.regressor import Motion
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass, extended, fast_length, spectrum
from wamctl.arm.errors import DataError

_EDGE_S = 0.5  # by which both ends are continued
_HIGHEST = 0.4  # of the sampling rate


@dataclass(frozen=True)
class ReversalPart:
    """A part of a joint's Coulomb friction, and how it turns round.

    Attributes:
        part: of the joint's friction; a joint's parts sum to one.
        scale: width of the curve over speed [rad/s], or distance after which it slips [rad].
        cutoff_hz: of the velocity that it follows; None: it follows the distance since a reversal.
        tailed: whether it is an arctangent of speed, not a ramp.
    """

    part: float
    scale: float
    cutoff_hz: float | None
    tailed: bool


@dataclass(frozen=True)
class Filter:
    """How the recordings of the fit were filtered, so that others can be compared with them alike.

    Attributes:
        cutoff_hz, order: the low-pass.
        differentiation_cutoff_hz: of the filter that differentiates positions.
        sign_cutoff_hz: of the velocity whose sign friction takes.
        parallel: whether torque and regressor pass the same filter.
        velocity_threshold_rad_s: slower samples were culled.
        reversals: how the friction of each joint turns round; empty: at once.
        delay_s: the torque acts so much later than its stamps.
    """

    cutoff_hz: float
    order: int
    differentiation_cutoff_hz: float
    sign_cutoff_hz: float
    parallel: bool
    velocity_threshold_rad_s: float
    reversals: tuple[tuple[ReversalPart, ...], ...] = ()
    delay_s: float = 0.0


def smooth_motion(t: Array, q: Array, filter_: Filter) -> tuple[Array, Motion]:
    """Even instants, and the motion at them.

    Args:
        t: instants [s], rising, shape (S,).
        q: joint positions at these [rad], shape (S, n).
        filter_: its differentiation filter is used.

    Raises:
        DataError: too few samples.
    """
    period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    edge = round(_EDGE_S / period) if period > 0.0 else 0
    if period <= 0.0 or len(t) <= 2 * edge:
        raise DataError(
            f"{len(t)} samples are too few to differentiate; a recording of more than"
            f" {2 * _EDGE_S:g} s with rising stamps is needed."
        )
    rate = 1.0 / period
    even = np.arange(round(t[-1] / period) + 1) * period
    held = np.column_stack([np.interp(even, t, column) for column in q.T])
    after = fast_length(len(held) + 2 * edge, 1) - len(held) - edge
    wave = spectrum(extended(held, edge, min(after, len(held) - 1)), rate)
    cutoff = min(filter_.differentiation_cutoff_hz, _HIGHEST * rate)
    lowpass = Lowpass(cutoff, filter_.order, rate)
    kept = slice(edge, edge + len(held))
    parts = [wave.signal(lowpass, derivative=d)[kept] for d in range(3)]
    return even, Motion(*(np.ascontiguousarray(x) for x in parts))
