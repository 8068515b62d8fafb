"""Figures with a row for each joint: dots, dumbbells, and bars."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.report.axis import Axis, linear_axis, logarithmic_axis
from ident.report.plot import legend, legend_width, line, marker, text_width, word
from ident.report.style import AFTER, BEFORE, BLUE, FLOOR, GREY, HALF, RULE, WIDE, Sign
from ident.report.svg import Drawing, element
from ident.report.words import number

Array = NDArray[np.floating]

_ROW = 30.0
_TOP = 34.0
_LEAST_NAMES = 150.0
_LEAST_NAMES_OF_HALF = 80.0
_GRID = Sign(RULE, "line", 1)


@dataclass(frozen=True)
class Dots:
    """Values of several kinds for each of some rows, on one axis.

    Attributes:
        title: what is shown.
        quantity: label of the axis, with its unit.
        rows: names.
        values: by kind, one for each row; None where there is none.
        signs: by kind.
        words: by kind, for the legend.
        logarithmic: whether equal steps are equal factors; else the axis begins at zero.
    """

    title: str
    quantity: str
    rows: Sequence[str]
    values: Mapping[str, Sequence[float | None]]
    signs: Mapping[str, Sign]
    words: Mapping[str, str]
    logarithmic: bool = True


def dots(content: Dots) -> Drawing:
    """One row per joint, one marker per kind."""
    numbers = {k: np.array(v, dtype=float) for k, v in content.values.items()}
    entries = [(content.words[k], content.signs[k]) for k in numbers]
    width, start = HALF, _names(content.rows, _LEAST_NAMES_OF_HALF)
    if start + legend_width(entries) > width:
        width, start = WIDE, _names(content.rows)
    place = (start, width - 20.0)
    x = (
        logarithmic_axis(content.quantity, list(numbers.values()), place)
        if content.logarithmic
        else linear_axis(content.quantity, list(numbers.values()), place, zero=True)
    )
    marks = legend(x.start, 16, entries)
    marks += _rows(content.rows, x)
    for i in range(len(content.rows)):
        found = [(k, v[i]) for k, v in numbers.items() if np.isfinite(v[i]) and v[i] >= x.low]
        marks += [marker(x.at(v), _middle(i), content.signs[k]) for k, v in found]
    said = "; ".join(
        f"{row}: "
        + ", ".join(f"{content.words[k]} {number(float(v[i]))}" for k, v in numbers.items())
        for i, row in enumerate(content.rows)
    )
    return _drawing(content.title, content.quantity, said, len(content.rows), marks, width)


def dumbbell(title: str, quantity: str, rows: Sequence[str], pairs: Array, floor: Array) -> Drawing:
    """Before and after per row, with the floor that no model can undercut.

    Args:
        title: what is shown.
        quantity: label of the axis, with its unit.
        rows: names.
        pairs: before and after, shape (rows, 2).
        floor: shape (rows,); not-a-number where none is known.
    """
    x = linear_axis(quantity, [pairs, floor], (_names(rows), WIDE - 20.0), zero=True)
    entries = [("before", BEFORE), ("after", AFTER)]
    entries += [("noise floor", FLOOR)] if np.isfinite(floor).any() else []
    marks = [*legend(x.start, 16, entries), *_rows(rows, x)]
    for i, (before, after) in enumerate(pairs.tolist()):
        y = _middle(i)
        if np.isfinite(pairs[i]).all():
            marks.append(line((x.at(before), y, x.at(after), y), Sign(GREY, "line", 2.5)))
            marks += [marker(x.at(before), y, BEFORE), marker(x.at(after), y, AFTER)]
        if np.isfinite(floor[i]):
            at = x.at(float(floor[i]))
            marks.append(line((at, y - 9, at, y + 9), FLOOR))
    said = "; ".join(
        f"{row}: {number(b)} before, {number(a)} after, floor {number(f)}"
        for row, (b, a), f in zip(rows, pairs.tolist(), floor.tolist(), strict=True)
    )
    return _drawing(title, quantity, said, len(rows), marks)


def bars(title: str, quantity: str, rows: Sequence[str], values: Sequence[float]) -> Drawing:
    """A bar per row from zero on, with its value."""
    lengths = np.asarray(values, dtype=float)
    x = linear_axis(quantity, [lengths], (_names(rows), WIDE - 70.0), zero=True)
    marks = _rows(rows, x)
    for i in np.flatnonzero(np.isfinite(lengths)).tolist():
        start, end = sorted((x.at(0.0), x.at(values[i])))
        y, size = _middle(i), max(end - start, 1.0)
        marks.append(element("rect", x=start, y=y - 8, width=size, height=16, fill=BLUE))
        marks.append(word(end + 6, y + 4, number(values[i])))
    said = "; ".join(f"{r}: {number(v)}" for r, v in zip(rows, values, strict=True))
    return _drawing(title, quantity, said, len(rows), marks)


def _names(rows: Sequence[str], least: float = _LEAST_NAMES) -> float:
    """Where the plot begins, to the right of the rows' names [px]."""
    return max(least, 20.0 + max(map(text_width, rows), default=0.0))


def _middle(row: int) -> float:
    return _TOP + _ROW * (row + 0.5)


def _rows(rows: Sequence[str], x: Axis) -> list[str]:
    """Grid, ticks, the rows' names, and the axis."""
    bottom = _TOP + _ROW * len(rows)
    marks = []
    for tick, text in zip(x.ticks, x.labels, strict=True):
        marks.append(line((x.at(tick), _TOP, x.at(tick), bottom), _GRID))
        marks.append(word(x.at(tick), bottom + 16, text, anchor="middle"))
    for i, row in enumerate(rows):
        marks.append(word(x.start - 12, _middle(i) + 4, row, anchor="end"))
        marks.append(line((x.start, _middle(i), x.end, _middle(i)), _GRID))
    marks.append(line((x.start, bottom, x.end, bottom), Sign(GREY, "line", 1)))
    marks.append(word((x.start + x.end) / 2, bottom + 34, x.label, anchor="middle"))
    return marks


def _drawing(
    title: str, quantity: str, said: str, rows: int, marks: Sequence[str], width: float = WIDE
) -> Drawing:
    height = _TOP + _ROW * rows + 44
    return Drawing(width, height, title, f"{quantity}. {said}.", tuple(marks))
