"""What plots are made of: frames with ticks and units, markers, words, and thinned curves."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.report.axis import Axis
from ident.report.style import GREY, INK, RULE, TEXT, Sign
from ident.report.svg import curve, element, group

Array = NDArray[np.floating]

BUCKETS = 260
"""A curve is drawn with at most two points for each of so many stretches of time."""

_SMALL = 4.5


@dataclass(frozen=True)
class Frame:
    """The area of a plot between its axes."""

    x: Axis
    y: Axis

    def marks(self, x_ticks: bool = True) -> list[str]:
        """Grid lines, ticks, and labels.

        Args:
            x_ticks: whether the horizontal axis carries words; the grid lines are drawn anyhow.
        """
        left, right = self.x.start, self.x.end
        bottom, top = self.y.start, self.y.end
        lines = [_line(self.x.at(t), bottom, self.x.at(t), top) for t in self.x.ticks]
        lines += [_line(left, self.y.at(t), right, self.y.at(t)) for t in self.y.ticks]
        marks = [group(lines, stroke=RULE, stroke_width=1)]
        marks += [
            word(left - 6, self.y.at(t) + 4, text, anchor="end")
            for t, text in zip(self.y.ticks, self.y.labels, strict=True)
        ]
        middle = (bottom + top) / 2
        marks.append(turned_word(left - 50, middle, self.y.label))
        if x_ticks:
            marks += [
                word(self.x.at(t), bottom + 16, text, anchor="middle")
                for t, text in zip(self.x.ticks, self.x.labels, strict=True)
            ]
            marks.append(word((left + right) / 2, bottom + 33, self.x.label, anchor="middle"))
        marks.append(_line(left, bottom, right, bottom, stroke=GREY))
        return marks

    def curve(self, x: Array, y: Array, sign: Sign) -> str:
        """A line through values, broken where they are no numbers."""
        dash = {"stroke_dasharray": sign.dash} if sign.dash else {}
        return curve(
            self.x.place(x), self.y.place(y), stroke=sign.colour, stroke_width=sign.width, **dash
        )


def _line(x1: float, y1: float, x2: float, y2: float, **attributes: str | float) -> str:
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, **attributes)


def line(ends: tuple[float, float, float, float], sign: Sign) -> str:
    """A straight line x1, y1, x2, y2 [px]."""
    dash = {"stroke_dasharray": sign.dash} if sign.dash else {}
    return _line(*ends, stroke=sign.colour, stroke_width=sign.width, **dash)


def word(x: float, y: float, text: str, anchor: str = "start", bold: bool = False) -> str:
    """Words on a drawing."""
    more = {"font_weight": "600"} if bold else {}
    return element("text", text, x=x, y=y, fill=INK, font_size=TEXT, text_anchor=anchor, **more)


def turned_word(x: float, y: float, text: str) -> str:
    """Words that read upwards."""
    turn = f"rotate(-90 {x:.1f} {y:.1f})"
    return element(
        "text", text, x=x, y=y, fill=INK, font_size=TEXT, text_anchor="middle", transform=turn
    )


def text_width(text: str) -> float:
    """About how wide words are on a drawing [px]."""
    return 0.54 * TEXT * len(text)


def marker(x: float, y: float, sign: Sign, size: float = _SMALL) -> str:
    """A point in the sign's colour and shape."""
    s, colour = size, sign.colour
    outline = {
        "square": f"M{x - s:.1f} {y - s:.1f}h{2 * s:.1f}v{2 * s:.1f}h{-2 * s:.1f}z",
        "diamond": f"M{x:.1f} {y - 1.3 * s:.1f}l{1.3 * s:.1f} {1.3 * s:.1f}l{-1.3 * s:.1f}"
        f" {1.3 * s:.1f}l{-1.3 * s:.1f} {-1.3 * s:.1f}z",
        "triangle": f"M{x:.1f} {y - 1.2 * s:.1f}l{1.2 * s:.1f} {2.1 * s:.1f}h{-2.4 * s:.1f}z",
        "down": f"M{x:.1f} {y + 1.2 * s:.1f}l{1.2 * s:.1f} {-2.1 * s:.1f}h{-2.4 * s:.1f}z",
    }
    strokes = {
        "cross": f"M{x - s:.1f} {y - s:.1f}l{2 * s:.1f} {2 * s:.1f}m0 {-2 * s:.1f}l{-2 * s:.1f}"
        f" {2 * s:.1f}",
        "plus": f"M{x - s:.1f} {y:.1f}h{2 * s:.1f}M{x:.1f} {y - s:.1f}v{2 * s:.1f}",
    }
    if sign.shape in outline:
        return element("path", d=outline[sign.shape], fill=colour, stroke="#fff", stroke_width=0.8)
    if sign.shape in strokes:
        return element("path", d=strokes[sign.shape], fill="none", stroke=colour, stroke_width=2)
    if sign.shape == "ring":
        return element("circle", cx=x, cy=y, r=s, fill="#fff", stroke=colour, stroke_width=2)
    return element("circle", cx=x, cy=y, r=s + 0.5, fill=colour, stroke="#fff", stroke_width=0.8)


def legend(x: float, y: float, entries: list[tuple[str, Sign]]) -> list[str]:
    """Signs and what they stand for, in one row from x on [px]."""
    marks = []
    for text, sign in entries:
        if sign.shape == "line":
            marks.append(line((x, y - 4, x + 22, y - 4), replace(sign, width=max(sign.width, 1.4))))
        else:
            marks.append(marker(x + 11, y - 4, sign))
        marks.append(word(x + 28, y, text))
        x += legend_width([(text, sign)])
    return marks


def legend_width(entries: list[tuple[str, Sign]]) -> float:
    """How much room a legend takes [px]."""
    return sum(50 + text_width(text) for text, _ in entries)


def thinned(t: Array, y: Array, buckets: int = BUCKETS) -> tuple[Array, Array]:
    """A curve with the lowest and the highest value of each stretch, in their order.

    Args:
        t: shape (S,).
        y: shape (S,); not-a-numbers stay gaps where a whole stretch has no other value.
        buckets: number of stretches.
    """
    size = -(-len(t) // buckets)
    if size <= 2:
        return t, y
    starts = size * np.arange(-(-len(t) // size))
    padded = np.full(size * len(starts), np.nan)
    padded[: len(y)] = y
    parts = padded.reshape(-1, size)
    gaps = np.isnan(parts)
    lowest = starts + np.argmin(np.where(gaps, np.inf, parts), axis=1)
    highest = starts + np.argmax(np.where(gaps, -np.inf, parts), axis=1)
    chosen = np.unique([lowest, highest])
    return t[chosen], y[chosen]
