"""Effect-free data whose friction turns round in another way than any fitted curve.

How dry friction turns round is never known, and what the fitted mixture of curves gets wrong looks
like an effect at low speed. So the fitted arm gets other curves, as near to the recordings as they
come, and the same search: what it gains there, the form of the reversals alone may gain.

A curve that the recordings speak against is none of theirs: those that explain them worse than the
fitted mixture, by more than an effect must gain at the least, are drawn again.

Curves of speed have an algebraic tail, s(u) = u / (1 + |u|^p)^(1/p); those of distance are Dahl's
with an exponent, df/dx = (1 - f sgn(v))^p / d (Dahl 1968). Exponents are drawn.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.nulls.null_arms import phase_randomised
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.residuals import residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.settings import EffectFreeData, GapSettings
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

_WIDTHS = np.geomspace(5e-4, 0.04, 10)  # rad/s
_DISTANCES = np.geomspace(5e-5, 3e-3, 8)  # rad
_SPEED = 1  # which of a segment's velocities is followed


@dataclass(frozen=True)
class ForeignCurve:
    """A smoothed sign that no mixture has.

    Attributes:
        exponent: of its tail, or of Dahl's equation.
        of_distance: whether it follows the distance, not the speed.
    """

    exponent: float
    of_distance: bool

    def __call__(self, s: SmoothedSegment, joint: int, scale: float) -> Array:
        """Values between -1 and 1, shape (S,), for a width [rad/s] or a distance [rad]."""
        if self.of_distance:
            return _stretched(np.ascontiguousarray(s.q[:, joint]), scale, self.exponent)
        u = s.speeds[_SPEED][:, joint] / scale
        return u / (1.0 + np.abs(u) ** self.exponent) ** (1.0 / self.exponent)

    @property
    def scales(self) -> Array:
        """Widths or distances that are tried."""
        return _DISTANCES if self.of_distance else _WIDTHS


def drawn_curve(rng: np.random.Generator, settings: EffectFreeData) -> ForeignCurve:
    """Any of them."""
    of_distance = bool(rng.random() < 0.3)
    tail, dahl = (settings.tail_low, settings.tail_high), (settings.dahl_low, settings.dahl_high)
    return ForeignCurve(float(rng.uniform(*(dahl if of_distance else tail))), of_distance)


def with_foreign_reversals(
    rows: WindowedRows,
    current: CurrentFit,
    larger: CurrentFit,
    settings: GapSettings,
    rng: np.random.Generator,
) -> WindowedRows:
    """The rows as they would be without the effects in question, and with other reversals.

    Args:
        rows: the recordings.
        current: the model without the effects in question.
        larger: the same with them.
        settings: of the search; a curve may explain a joint worse than the fitted mixture by the
            least gain of an effect.
        rng: draws curves and noise.
    """
    design, found = larger.design(rows), larger.fit
    left = residuals(design, found)
    torque = rows.torque.copy()
    for j, r in enumerate(left):
        if len(r.values) == 0:
            continue
        fitted = found.coulomb[j] * (rows.reversals[:, j] @ found.structure.shapes[j])
        weight = ~r.excluded / found.sigma[j][r.region]
        target, error = r.values + fitted, weight * r.values
        worst = np.exp(2.0 * settings.thresholds.min_gain) * (error @ error)
        for _ in range(settings.effect_free_data.curve_draws):
            curve = drawn_curve(rng, settings.effect_free_data)
            foreign, least = _nearest(rows, j, target, weight, curve)
            if least <= worst:
                break
        else:
            foreign = fitted
        torque[:, j] += foreign - fitted - r.values + phase_randomised(r, rng)
        for i in range(len(current.accepted), len(larger.accepted)):
            if j in design.index[i].joints:
                torque[:, j] -= design.effect_columns(i, j) @ found.effects[i]
    return replace(rows, torque=torque)


def _nearest(
    rows: WindowedRows, joint: int, target: Array, weight: Array, curve: ForeignCurve
) -> tuple[Array, float]:
    """Friction by a curve of the scale that comes nearest to a target, and its squared error.

    The friction [N m] has the shape (R,); the error is weighted.
    """
    best, least = target, np.inf
    for scale in curve.scales:
        turning = rows.blocks.means(partial(curve, joint=joint, scale=float(scale)))
        columns = np.column_stack([turning, rows.viscous[:, joint]])
        values = np.linalg.lstsq(columns * weight[:, None], target * weight, rcond=None)[0]
        error = weight * (target - columns @ values)
        if error @ error < least:
            best, least = columns @ values, float(error @ error)
    return best, least


@compiled
def _stretched(q, distance, exponent):
    f, out = 0.0, np.empty(len(q))
    out[0] = 0.0
    for k in range(1, len(q)):
        step = q[k] - q[k - 1]
        ahead = 1.0 if step >= 0.0 else -1.0
        room = max(1.0 - f * ahead, 0.0)
        f += step / distance * room**exponent
        f = min(max(f, -1.0), 1.0)
        out[k] = f
    return out
