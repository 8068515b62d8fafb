"""Figures with two axes: torque and motion over time, sweeps, and maps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.report.axis import linear_axis, time_axis
from ident.report.plot import Frame, line, marker, thinned, word
from ident.report.style import (
    HALF,
    INK,
    LIMIT,
    MEASURED,
    PLANNED,
    PREDICTED,
    RESIDUAL,
    Sign,
)
from ident.report.svg import Drawing, element
from ident.report.words import number

Array = NDArray[np.floating]

_LEFT = 64.0


@dataclass(frozen=True)
class Series:
    """One joint's torque, or motion, over time.

    Attributes:
        label: the joint.
        unit: of its torque, force, or motion.
        t: time [s], shape (S,).
        measured, predicted: shape (S,).
        counted: samples that the errors count, shape (S,); the others were culled.
        note: the joint's error in words.
        quantity: what is drawn.
    """

    label: str
    unit: str
    t: Array
    measured: Array
    predicted: Array
    counted: NDArray[np.bool_]
    note: str
    quantity: str = "torque"


def torque_over_time(series: Series) -> Drawing:
    """Measured and predicted torque above, what is left below on a scale of its own."""
    left, right = _LEFT, HALF - 14.0
    t = time_axis("time [s]", series.t, (left, right))
    rest = np.where(series.counted, series.measured - series.predicted, np.nan)
    above = linear_axis(
        f"{series.quantity} [{series.unit}]", [series.measured, series.predicted], (158.0, 26.0)
    )
    below = linear_axis(f"residual [{series.unit}]", [rest], (246.0, 176.0), most=2, zero=True)
    upper, lower = Frame(t, above), Frame(t, below)
    marks = [
        word(left, 15, series.label, bold=True),
        word(right, 15, series.note, anchor="end"),
        *upper.marks(x_ticks=False),
        upper.curve(*thinned(series.t, series.measured), MEASURED),
        upper.curve(*thinned(series.t, series.predicted), PREDICTED),
        *lower.marks(),
        lower.curve(*thinned(series.t, rest), RESIDUAL),
    ]
    description = (
        f"Joint {series.label}: measured and predicted {series.quantity} from {number(t.low)} to"
        f" {number(t.high)} s, and their difference; {series.note}."
    )
    title = f"{series.quantity.capitalize()} of joint {series.label} over time"
    return Drawing(HALF, 284.0, title, description, tuple(marks))


def within_limits(label: str, quantity: str, t: Array, values: Array, bounds: Array) -> Drawing:
    """Something over time, between its limits.

    Args:
        label: what has it.
        quantity: label of the axis, with its unit.
        t: time [s], shape (S,).
        values: shape (S,).
        bounds: lower and upper, shape (2,); not finite where there is none.
    """
    finite = bounds[np.isfinite(bounds)]
    frame = Frame(
        time_axis("time [s]", t, (_LEFT, HALF - 14.0)),
        linear_axis(quantity, [values, finite], (166.0, 26.0)),
    )
    y = [frame.y.at(float(b)) for b in finite]
    marks = [
        word(_LEFT, 15, label, bold=True),
        *frame.marks(),
        *(line((frame.x.start, p, frame.x.end, p), LIMIT) for p in y),
        frame.curve(*thinned(t, values), PLANNED),
    ]
    description = (
        f"{quantity} of {label} lies between {number(float(values.min()))} and"
        f" {number(float(values.max()))}; limits {', '.join(number(float(b)) for b in finite)}."
    )
    return Drawing(HALF, 206.0, f"{quantity} of {label} over time", description, tuple(marks))


@dataclass(frozen=True)
class Trend:
    """A curve with points, one of several that share an axis."""

    words: str
    sign: Sign
    y: Array


def sweep(
    title: str, axes: tuple[str, str], x: Array, trends: Sequence[Trend], at: tuple[float, str]
) -> Drawing:
    """Curves over a swept setting, with the setting that was taken.

    Args:
        title: what is shown.
        axes: labels of both axes, with their units.
        x: values of the setting, shape (T,).
        trends: curves, each of shape (T,).
        at: the setting that was taken, and its name.
    """
    frame = Frame(
        time_axis(axes[0], x, (_LEFT, HALF - 14.0), most=5),
        linear_axis(axes[1], [t.y for t in trends], (226.0, 44.0)),
    )
    place = frame.x.at(at[0])
    anchor = "start" if place < HALF / 2 else "end"
    marks = [
        word(_LEFT, 15, title, bold=True),
        *frame.marks(),
        line((place, frame.y.start, place, frame.y.end), Sign(INK, "line", 1.2, "3 3")),
        word(place, frame.y.end - 6, at[1], anchor=anchor),
    ]
    for trend in trends:
        marks.append(frame.curve(x, trend.y, trend.sign))
        places = zip(frame.x.place(x), frame.y.place(trend.y), strict=True)
        marks += [marker(float(px), float(py), trend.sign, 3.2) for px, py in places]
    ends = ", ".join(
        f"{t.words} from {number(float(t.y[0]))} to {number(float(t.y[-1]))}" for t in trends
    )
    description = f"{axes[1]} over {axes[0]}: {ends}. {at[1]} at {number(at[0])}."
    return Drawing(HALF, 268.0, title, description, tuple(marks))


def region_map(
    label: str, axes: tuple[str, str], edges: tuple[Array, Array], values: Array, most: float
) -> Drawing:
    """How much is left over a plane, for example of position and velocity, as shades of blue.

    Args:
        label: what the map belongs to.
        axes: labels of both axes, with their units.
        edges: of the cells, of shapes (X + 1,) and (Y + 1,).
        values: shape (X, Y); not-a-number where there are no data.
        most: value of the darkest shade, above zero, the same for all maps of a page.
    """
    frame = Frame(
        time_axis(axes[0], edges[0], (_LEFT, HALF - 14.0), most=5),
        time_axis(axes[1], edges[1], (196.0, 26.0), most=4),
    )
    across, up = frame.x.place(edges[0]).tolist(), frame.y.place(edges[1]).tolist()
    cells = [
        element(
            "rect",
            x=across[i],
            y=up[j + 1],
            width=across[i + 1] - across[i],
            height=up[j] - up[j + 1],
            fill=shade(float(values[i, j]) / most),
        )
        for i, j in np.argwhere(np.isfinite(values)).tolist()
    ]
    marks = [word(_LEFT, 15, label, bold=True), *frame.marks(), *cells]
    description = f"{axes[1]} over {axes[0]}: {_largest(edges, values)}."
    return Drawing(HALF, 236.0, label, description, tuple(marks))


def _largest(edges: tuple[Array, Array], values: Array) -> str:
    """Where the largest value of a map is, in words."""
    if not np.isfinite(values).any():
        return "no data"
    i, j = np.unravel_index(int(np.nanargmax(values)), values.shape)
    x, y = (float(e[k : k + 2].mean()) for e, k in zip(edges, (i, j), strict=True))
    return f"largest, {number(float(values[i, j]))}, near {number(x)} and {number(y)}"


def shade(strength: float) -> str:
    """From nearly white at 0 to dark blue at 1, in even steps of lightness."""
    strength = min(max(strength, 0.0), 1.0)
    light, dark = np.array([240, 246, 251]), np.array([0, 62, 107])
    return "#{:02x}{:02x}{:02x}".format(*(light + strength * (dark - light)).round().astype(int))
