"""SVG as text: elements, curves, and drawings that can be read aloud."""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Drawing:
    """A picture and its words.

    Attributes:
        width, height: of its coordinates [px].
        title: what it shows, in a few words.
        description: what there is to see, for those who cannot see it.
        marks: elements, from the back to the front.
    """

    width: float
    height: float
    title: str
    description: str
    marks: tuple[str, ...]

    def svg(self, name: str) -> str:
        """The drawing as one `svg` element, as wide as the place that it is put in.

        Args:
            name: what makes its ids differ from those of other drawings of the page.
        """
        ids = (f"{name}-title", f"{name}-description")
        words = element("title", self.title, id=ids[0]) + element(
            "desc", self.description, id=ids[1]
        )
        body = "".join((words, *self.marks))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_short(self.width)}'
            f' {_short(self.height)}" role="img" aria-labelledby="{ids[0]} {ids[1]}">{body}</svg>'
        )


def element(tag: str, text: str = "", /, **attributes: str | float) -> str:
    """One element with escaped text; `stroke_width` becomes `stroke-width`."""
    words = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{_attribute(value)}"'
        for name, value in attributes.items()
    )
    return f"<{tag}{words}>{escape(text)}</{tag}>" if text else f"<{tag}{words}/>"


def group(marks: Iterable[str], **attributes: str | float) -> str:
    """Elements that share attributes."""
    opening = element("g", **attributes)[:-2]
    return f"{opening}>{''.join(marks)}</g>"


def curve(x: Array, y: Array, **attributes: str | float) -> str:
    """A line through points [px], broken where y is not a number."""
    return element("path", d=_path(x, y), fill="none", stroke_linejoin="round", **attributes)


def _path(x: Array, y: Array) -> str:
    parts, move = [], True
    for px, py in zip(x.tolist(), y.tolist(), strict=True):
        if py != py:
            move = True
            continue
        parts.append(f"{'M' if move else 'L'}{_short(px)} {_short(py)}")
        move = False
    return "".join(parts)


def _attribute(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else _short(value)


def _short(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
