"""Colours, signs, and sizes of all figures; the colours are Okabe and Ito's, for every eye."""

from dataclasses import dataclass

INK = "#1b1b1b"
GREY = "#6b6b6b"
RULE = "#dcdcdc"
BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE = "#0072b2", "#d55e00", "#cc79a7"

WIDE = 960.0
"""Width of a figure that takes the whole page [px]."""

HALF = 470.0
"""Width of one of two figures side by side [px]."""

TEXT = 12.0
"""Size of the words in figures [px]."""


@dataclass(frozen=True)
class Sign:
    """How one kind of thing looks in every figure: never by colour alone."""

    colour: str
    shape: str
    width: float = 1.6
    dash: str = ""


ESTIMATOR_SIGNS = {
    "cad": Sign(GREY, "square"),
    "ols": Sign(ORANGE, "diamond"),
    "wls": Sign(PURPLE, "triangle"),
    "irls": Sign(SKY, "cross"),
    "iv": Sign(BLACK, "plus"),
    "feasible": Sign(BLUE, "circle"),
    "feasible_wls": Sign(GREEN, "down"),
    "feasible_cad": Sign(VERMILION, "ring"),
    "feasible_entropic": Sign(GREEN, "ring"),
}

MEASURED = Sign(SKY, "line", 3.6)
BEFORE = Sign(ORANGE, "square")
AFTER = Sign(BLUE, "circle")
FLOOR = Sign(INK, "line", 2.0)
PREDICTED = Sign(INK, "line", 1.1)
PLANNED = Sign(BLUE, "line", 1.6)
LIMIT = Sign(VERMILION, "line", 1.4, "6 3")
RESIDUAL = Sign(VERMILION, "line", 1.0)
