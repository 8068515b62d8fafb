"""Colours and signs of all figures; the colours are Okabe and Ito's, for every eye."""

from dataclasses import dataclass

INK = "#1b1b1b"
GREY = "#6b6b6b"
BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE = "#0072b2", "#d55e00", "#cc79a7"


@dataclass(frozen=True)
class Sign:
    """How one kind of thing looks in every figure: never by colour alone.

    Attributes:
        colour: as CSS writes it.
        shape: `line`, `band`, `bar`, or the marker of a point.
        width: of a line [px].
        dash: lengths of strokes and gaps [px].
    """

    colour: str
    shape: str = "line"
    width: float = 1.6
    dash: tuple[float, ...] = ()


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

MEASURED = Sign(SKY, width=3.6)
PREDICTED = Sign(INK, width=1.1)
RESIDUAL = Sign(VERMILION, width=1.0)
BEFORE = Sign(ORANGE, "square")
AFTER = Sign(BLUE, "circle")
FLOOR = Sign(INK, width=2.0)
WITHOUT = Sign(ORANGE, width=1.2)
WITH = Sign(BLUE, width=1.2, dash=(5, 2))
