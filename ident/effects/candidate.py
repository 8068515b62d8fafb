"""An effect at a place: the numbers that it is linear in, and those that shape its columns."""

from dataclasses import KW_ONLY, dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np


@dataclass(frozen=True)
class Coefficient:
    """A number that multiplies one column.

    Attributes:
        name: in the result file.
        unit: SI.
        lower, upper: what is physically plausible.
        min_size: smaller ones are not worth a name.
        defining: without it the effect is another one.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    min_size: float = 0.0
    defining: bool = False


@dataclass(frozen=True)
class NonlinearParameter:
    """A number that shapes the columns, found by a grid and refined.

    Attributes:
        name: field of the effect's `Parameters`, and name in the result file.
        unit: SI.
        grid: values of the first search, ascending.
        lower, upper: bounds of the refinement.
        discrete: only the grid's own values make sense.
        linear_grid: its steps are differences, not ratios, as it may be zero.
        refine_only: values beyond the first are tried only once the effect leads.
        is_parameter: whether it is reported as a parameter of the effect; else it is only a help
            of the search.
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    _: KW_ONLY
    discrete: bool = False
    linear_grid: bool = False
    refine_only: bool = False
    is_parameter: bool = True


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation and unit."""

    value: float
    sd: float
    unit: str


class NoParameters(NamedTuple):
    """The parameters of an effect whose columns have no shape to choose."""


P = TypeVar("P")


@dataclass(frozen=True)
class Candidate(Generic[P]):
    """An effect at a place, with its shape.

    Attributes:
        effect: id of the effect.
        joints: the joints named, from 0.
        rows: the joints whose torque changes, from 0.
        coefficients: one for each column.
        parameters: what shapes the columns: a NamedTuple of the effect's own.
        variant: which of the effect's forms it is.
    """

    effect: str
    joints: tuple[int, ...]
    rows: tuple[int, ...]
    coefficients: tuple[Coefficient, ...]
    parameters: P
    variant: str = ""

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from every other candidate."""
        return (self.effect, self.joints, self.rows, self.variant, self.parameters)

    @property
    def numbers(self) -> dict[str, float]:
        """The single numbers among its parameters, by name; those that it does not use left out."""
        named = fields_of(self.parameters)
        return {name: value for name, value in named.items() if isinstance(value, float)}


def fields_of(parameters: Any) -> dict[str, Any]:
    """The fields of an effect's parameters by name."""
    return parameters._asdict()
