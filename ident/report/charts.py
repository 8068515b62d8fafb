"""Charts as data: what `templates/charts.js` draws in the page with uPlot."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.report.style import Sign
from ident.report.words import number
from ident.signals.arrays import Array

BUCKETS = 220
"""Each curve keeps its lowest and highest value in every one of so many stretches of time."""

_STEPS = 20_000  # a curve's values are written to this part of their range
_MOST_PLACES = 100


@dataclass(frozen=True)
class Chart:
    """One chart and its words.

    Attributes:
        title: what it shows.
        description: what there is to see, for those who cannot see it.
        spec: what the page's script draws.
        joint: name in the joint chooser; empty where there is nothing to choose.
    """

    title: str
    description: str
    spec: Mapping[str, Any]
    joint: str = ""


@dataclass(frozen=True)
class Curve:
    """One curve of a panel.

    Attributes:
        name: in the legend; curves of one name are shown and hidden together.
        sign: how it looks.
        y: shape (S,), or (2, S) for a band; None for a difference.
        minus: numbers of two curves of the chart, counted from its first panel on, whose
            difference it is.
        points: whether points stand on the line.
    """

    name: str
    sign: Sign
    y: Array | None = None
    minus: tuple[int, int] | None = None
    points: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves over one vertical axis.

    Attributes:
        label: quantity with its unit.
        curves: in the order of drawing.
        height: [px].
        limits: horizontal lines.
        reach: the axis ends at plus and minus this until the reader zooms; None: at the values.
    """

    label: str
    curves: Sequence[Curve]
    height: int = 190
    limits: Sequence[float] = ()
    reach: float | None = None


def line_chart(
    title: str,
    x: tuple[str, Array],
    panels: Sequence[Panel],
    *,
    at: float | None = None,
    shaded: Sequence[tuple[float, float]] = (),
    joint: str = "",
) -> Chart:
    """Curves over one quantity, in panels below each other that zoom together.

    Args:
        title: what it shows.
        x: label of the horizontal axis, and its values, shape (S,), ascending.
        panels: from top to bottom.
        at: where a vertical line stands.
        shaded: spans of x with a grey ground.
        joint: name in the joint chooser.
    """
    spec = {
        "kind": "lines",
        "x_label": x[0],
        "x": _numbers(x[1]),
        "at": at,
        "shaded": [_numbers(np.array(s)) for s in shaded],
        "panels": [
            {"label": p.label, "height": p.height, "limits": list(p.limits), "reach": p.reach}
            | {"series": [_curve(c) for c in p.curves]}
            for p in panels
        ],
    }
    said = [_range_of(p.label, c) for p in panels for c in p.curves if c.y is not None]
    return Chart(title, f"Over {x[0]}: {'; '.join(said)}.", spec, joint=joint)


def row_chart(
    title: str,
    label: str,
    rows: Sequence[str],
    values: Mapping[str, tuple[Sign, Sequence[float | None]]],
    *,
    factors: bool = False,
    joined: bool = False,
) -> Chart:
    """Values of one or several kinds for each row, on one horizontal axis.

    Args:
        title: what it shows.
        label: quantity with its unit.
        rows: names.
        values: sign and one value for each row, by kind.
        factors: whether equal steps of the axis are equal factors.
        joined: whether a line joins the first two kinds.
    """
    columns = {k: np.array(v, dtype=float) for k, (_, v) in values.items()}
    spec = {
        "kind": "rows",
        "label": label,
        "rows": list(rows),
        "log": factors,
        "joined": [0, 1] if joined else [],
        "series": [
            {"name": k, "sign": asdict(sign), "y": _numbers(columns[k])}
            for k, (sign, _) in values.items()
        ],
    }
    said = "; ".join(
        f"{row}: " + ", ".join(f"{k} {number(float(v[i]))}" for k, v in columns.items())
        for i, row in enumerate(rows)
    )
    return Chart(title, f"{label}. {said}.", spec)


def map_chart(
    title: str,
    labels: tuple[str, str],
    edges: tuple[Array, Array],
    values: Array,
    most: float,
    names: Sequence[str] = (),
) -> Chart:
    """Values over a plane as shades of blue; with names, signed values of pairs of things.

    Args:
        title: what it shows.
        labels: of both axes, with their units.
        edges: of the cells, of shapes (X + 1,) and (Y + 1,).
        values: shape (X, Y); not-a-number where there is nothing.
        most: value of the darkest shade.
        names: of rows and columns alike; none where the axes carry numbers.
    """
    spec = {
        "kind": "map",
        "x_label": labels[0],
        "y_label": labels[1],
        "x": _numbers(edges[0]),
        "y": _numbers(edges[1]),
        "z": [_numbers(column) for column in np.round(values, 3 if names else 6)],
        "most": most,
        "names": list(names) or None,
        "signed": bool(names),
    }
    return Chart(title, f"{labels[1]} over {labels[0]}: {_largest(edges, values)}.", spec)


def kept_samples(*curves: Array, buckets: int = BUCKETS) -> NDArray[np.int64]:
    """Places of the samples that a chart needs: no peak of any curve is lost.

    Args:
        curves: shape (S,) each; not-a-numbers are passed over.
        buckets: number of stretches, each of which keeps every curve's lowest and highest value.
    """
    count = len(curves[0])
    size = -(-count // buckets)
    if size <= 2 * len(curves):
        return np.arange(count)
    starts = size * np.arange(-(-count // size))
    kept = [np.array([0, count - 1])]
    for y in curves:
        padded = np.full(size * len(starts), np.nan)
        padded[:count] = y
        parts = padded.reshape(-1, size)
        gaps = np.isnan(parts)
        kept.append(starts + np.argmin(np.where(gaps, np.inf, parts), axis=1))
        kept.append(starts + np.argmax(np.where(gaps, -np.inf, parts), axis=1))
    return np.unique(np.concatenate(kept))


def spans_of(t: Array, inside: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Stretches of time in which something holds, in at most 200 pieces, the longest kept."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    ends = [(float(t[a]), float(t[min(b, len(t) - 1)])) for a, b in edges.reshape(-1, 2)]
    return sorted(sorted(ends, key=lambda e: e[0] - e[1])[:200])


def _curve(curve: Curve) -> dict[str, Any]:
    y = None if curve.y is None else _numbers(curve.y)
    told = {"name": curve.name, "sign": asdict(curve.sign), "y": y}
    return told | ({"minus": curve.minus} if curve.minus else {}) | {"points": curve.points}


def _numbers(values: Array) -> list[Any]:
    """Values for JSON: rounded to a small part of their range, null where there is none."""
    values = np.asarray(values, dtype=float)
    finite = values[np.isfinite(values)]
    reach = float(np.ptp(finite)) or float(np.abs(finite).max()) if len(finite) else 0.0
    places = 4 if not reach else min(int(np.ceil(-np.log10(reach / _STEPS))), _MOST_PLACES)
    rounded = np.round(values, places).astype(object)
    rounded[~np.isfinite(values)] = None
    return rounded.tolist()


def _range_of(label: str, curve: Curve) -> str:
    y = np.asarray(curve.y, dtype=float)
    if not np.isfinite(y).any():
        return f"{curve.name}: no data"
    return f"{curve.name}, {label}, from {number(np.nanmin(y))} to {number(np.nanmax(y))}"


def _largest(edges: tuple[Array, Array], values: Array) -> str:
    """Where the largest value of a map is, in words."""
    if not np.isfinite(values).any():
        return "no data"
    i, j = np.unravel_index(int(np.nanargmax(np.abs(values))), values.shape)
    x, y = (float(e[k : k + 2].mean()) for e, k in zip(edges, (i, j), strict=True))
    return f"largest, {number(float(values[i, j]))}, near {number(x)} and {number(y)}"
