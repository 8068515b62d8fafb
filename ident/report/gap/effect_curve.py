"""The torque of an effect over the quantity that it depends on, with what was measured there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.parameters import of_joint
from ident.gap.data.noise_regions import Region
from ident.gap.results.held_out_error import BeforeAfter
from ident.gap.results.outcome import SearchResult
from ident.report.words import number, share, unit_text
from ident.signals.arrays import Array

_BINS = 40
_SHOWS = 0.3  # times the residual with the effect: less while sliding, and reversals are drawn too
_MOST = 0.8  # of the effect's squared torque
_EXPLAINED = 0.6  # of the effect's variance: less, and no single quantity draws it as a curve
OWN_TORQUE = "torque of the effect by the model [N·m]"
"""The variable of an effect that depends on several quantities at once."""


@dataclass(frozen=True)
class EffectCurve:
    """Means over bins of the rows, each of shape (B,).

    Attributes:
        variable: what the effect depends on most, with its unit.
        unit: of the torque, in print.
        x: of that variable, ascending.
        effect: torque of the effect [N m].
        measured: torque that the rest of the model leaves [N m].
        low, high: between them lie two thirds of it [N m].
        before, after: rms residual without the effects and with them [N m].
        where: the range of the variable in which the effect acts most, in a sentence.
    """

    variable: str
    unit: str
    x: Array
    effect: Array
    measured: Array
    low: Array
    high: Array
    before: Array
    after: Array
    where: str


def effect_curve(found: SearchResult, both: BeforeAfter, index: int, joint: int) -> EffectCurve:
    """One effect at one joint, where the joint slides.

    Args:
        found: the search.
        both: residuals without and with the effects.
        index: of the effect among those that were taken in.
        joint: from 0.
    """
    whole = _torque(found, both, index, joint)
    rows = both.after[joint].region != Region.REVERSAL
    residual = both.after[joint].values[rows]
    if whole[rows] @ whole[rows] <= _SHOWS**2 * (residual @ residual):
        rows = np.ones_like(rows)
    torque = whole[rows]
    seen = {name: x[rows] for name, x in _variables(found, both, joint).items()}
    variable, x = _own_variable(seen, torque)
    bins = _bins(x, torque)
    left, without = both.after[joint].values[rows], both.before[joint].values[rows]
    measured = left + torque

    def mean(values: Array) -> Array:
        return np.array([values[b].mean() for b in bins])

    low, high = (np.array([np.quantile(measured[b], p) for b in bins]) for p in (1 / 6, 5 / 6))
    before, after = (np.sqrt(mean(v**2)) for v in (without, left))
    columns = [mean(x), mean(torque), mean(measured), low, high, before, after]
    if "speed" in variable:  # friction jumps there: the two directions are two curves
        columns = [
            np.insert(c, np.searchsorted(columns[0], 0.0), np.nan if i else 0.0)
            for i, c in enumerate(columns)
        ]
    return EffectCurve(
        variable, units_of(found, joint)[0], *columns, where=_where(variable, x, torque)
    )


def _where(variable: str, x: Array, torque: Array) -> str:
    """Where most of an effect's torque acts; nothing where it acts alike everywhere."""
    name, _, unit = variable.rstrip("]").partition(" [")
    if name.startswith(("torque", "time")):
        return ""
    size = np.abs(x) if "speed" in name or "acceleration" in name else x
    order = np.argsort(size, kind="stable")
    part = np.cumsum(torque[order] ** 2) / max(float(torque @ torque), 1e-300)
    rising, falling = np.searchsorted(part, [_MOST, 1 - _MOST])
    last = len(order) - 1
    if rising < last - falling:
        edge, samples = f"below {number(float(size[order[min(rising, last)]]), 2)}", rising
    else:
        edge, samples = f"above {number(float(size[order[falling]]), 2)}", last - falling
    if samples > _MOST * last:
        return ""
    return (
        f"{share(_MOST, 2)} of its squared torque acts at a {name} {edge}\u202f{unit}, in"
        f" {share(samples / max(last, 1), 2)} of the samples"
    )


def motion_of(found: SearchResult) -> tuple[Array, Array, Array]:
    """Position, velocity, and acceleration of each row, each of shape (R, n)."""
    rows = found.rows
    means = rows.blocks.means
    return means(lambda s: s.q), means(lambda s: s.qd), means(lambda s: s.qdd)


def units_of(found: SearchResult, joint: int) -> tuple[str, str]:
    """Units of a joint's torque, a force where it slides, and of its position, in print."""
    slides = bool(found.end.model.facts.chain.sliding[joint])
    return unit_text(of_joint("N m", slides)), of_joint("rad", slides)


def _torque(found: SearchResult, both: BeforeAfter, index: int, joint: int) -> Array:
    """Of an effect at a joint [N m], shape (R,)."""
    if joint not in both.design.index[index].joints:
        return np.zeros(len(both.design.t))
    return both.design.effect_columns(index, joint) @ found.end.fit.effects[index]


def _variables(found: SearchResult, both: BeforeAfter, joint: int) -> dict[str, Array]:
    """What an effect may depend on, shape (R,) each, the likeliest first."""
    q, qd, qdd = motion_of(found)
    torque, way = units_of(found, joint)
    named = {f"speed [{way}/s]": qd[:, joint]}
    matrix = found.end.model.facts.motor_from_joint
    for k, row in enumerate(() if matrix is None else matrix):
        if row[joint] and np.count_nonzero(row) > 1:
            named[f"speed of motor {k + 1} [rad/s]"] = qd @ row
            named[f"acceleration of motor {k + 1} [rad/s²]"] = qdd @ row
    return named | {
        f"position [{way}]": q[:, joint],
        f"acceleration [{way}/s²]": qdd[:, joint],
        "time [s]": both.design.t,
        f"measured torque [{torque}]": both.design.columns[joint][:, -1],
    }


def _own_variable(variables: dict[str, Array], torque: Array) -> tuple[str, Array]:
    """The variable over which the effect's torque is most nearly one curve."""
    spread = float(torque.var())
    if spread <= 1e-12 * float(np.mean(torque**2)):  # the same everywhere
        return "time [s]", variables["time [s]"]
    scatter = {name: _scatter(x, torque) / spread for name, x in variables.items()}
    best = min(scatter, key=lambda name: scatter[name])
    return (best, variables[best]) if scatter[best] < 1 - _EXPLAINED else (OWN_TORQUE, torque)


def _scatter(x: Array, torque: Array) -> float:
    """Mean square of the torque about its means over bins of a variable [N^2 m^2]."""
    parts = (torque[b] for b in _bins(x, torque))
    return float(sum(len(p) * p.var() for p in parts)) / len(torque)


def _bins(x: Array, torque: Array) -> list[NDArray[np.int64]]:
    """Rows in ascending x, in parts that hold as much of the rows and the torque; cut at zero."""
    order = np.argsort(x, kind="stable")
    size = np.abs(torque[order])
    weight = 1 / len(order) + size / max(float(size.sum()), 1e-300)
    ends = np.searchsorted(np.cumsum(weight), 2 * np.arange(1, _BINS) / _BINS)
    cuts = np.unique([*ends, np.searchsorted(x[order], 0.0)])
    return [part for part in np.split(order, cuts) if len(part)]
