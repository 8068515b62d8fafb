"""The interface of an effect: what is known of one thing that a rigid-body model can miss."""

from dataclasses import KW_ONLY, dataclass, field
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Coefficient:
    """A number that multiplies one column.

    Attributes:
        name: in the result file.
        unit: SI.
        lower, upper: what is physically plausible.
        least: smaller ones are not worth a name.
        essential: without it the effect is another one.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    least: float = 0.0
    essential: bool = False


@dataclass(frozen=True)
class Setting:
    """A number that shapes the columns.

    Attributes:
        name: in the result file.
        unit: SI.
        grid: values of the first search, ascending.
        lower, upper: bounds of the refinement.
        whole: only the grid's own values make sense.
        even: its steps are differences, not ratios, as it may be zero.
        late: values beyond the first are tried only once the effect leads.
        reported: whether it is a parameter of the effect, not only a help of the search.
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    _: KW_ONLY
    whole: bool = False
    even: bool = False
    late: bool = False
    reported: bool = True


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation and unit."""

    value: float
    sd: float
    unit: str


@dataclass(frozen=True)
class Hypothesis:
    """An effect at a place, with its shape.

    Attributes:
        effect: id of the effect.
        joints: the joints named, from 0.
        rows: the joints whose torque changes, from 0.
        coefficients: one for each column.
        settings: values that shape the columns, by name.
        variant: which of the effect's forms it is.
    """

    effect: str
    joints: tuple[int, ...]
    rows: tuple[int, ...]
    coefficients: tuple[Coefficient, ...]
    settings: dict[str, float] = field(default_factory=dict)
    variant: str = ""

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from every other hypothesis."""
        return (self.effect, self.joints, self.rows, self.variant, *self.settings.items())


class FormUncertainty(Enum):
    """What the form of an effect may get wrong."""

    NONE = "nothing: its equation leaves no freedom"
    SPEED = "a curve over the joint's speed, which follows its direction"
    EITHER_WAY = "a curve over the joint's speed, the same in both directions"
    POSITION = "a curve over the joint's position"
    TIME = "a curve over time, of friction"
    ANY = "anything"


class Effect(Protocol):
    """One effect: one file, one class, one object named EFFECT.

    Attributes:
        id: name in the result file.
        title: in plain words.
        equation: added to the joint torque.
        source: where the equation comes from.
        signature: what it looks like in the residual.
        rivals: effects that look alike.
        contains: effects that are special cases of it.
        experiment: motion that tells it from them.
        compares: whether it shows only against a model that was trusted before.
        freedom: of its form; what is left of an effect that is found may be its form's error.
        smooth: whether its columns vary no faster than the links move, so that a lower rate does.
        uses: what its columns depend on: `direction` of friction, `model` torque, the model's
            `friction`, whole `torque`.
        settings: what shapes its columns.
    """

    id: str
    title: str
    equation: str
    source: str
    signature: str
    rivals: tuple[str, ...]
    contains: tuple[str, ...]
    experiment: str
    compares: bool
    freedom: FormUncertainty
    smooth: bool
    uses: tuple[str, ...]
    settings: tuple[Setting, ...]

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """All places and grid points where the effect may be looked for."""
        ...

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Torque per unit of each coefficient, shape (S, len(rows), k)."""
        ...

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """The arm with the effect in, for coefficients of shape (k,)."""
        ...


@runtime_checkable
class Reshapes(Protocol):
    """An effect whose coefficients have units or bounds that hang on its settings."""

    def coefficients(self, settings: dict[str, float]) -> tuple[Coefficient, ...]:
        """The numbers that multiply its columns."""
        ...


@runtime_checkable
class Linearises(Protocol):
    """An effect that is not linear in its coefficients: its columns are formed about some."""

    def about(self, hypothesis: Hypothesis, values: Array) -> Hypothesis:
        """The same with its columns formed about coefficients of shape (k,)."""
        ...


@runtime_checkable
class Steepens(Protocol):
    """A drag beside the viscous one: where the two fall with speed from rest on, it is another."""

    def falls(self, values: Array, viscous: float) -> bool:
        """Whether friction would fall from rest on, for coefficients and a viscous one."""
        ...


@runtime_checkable
class Extrapolates(Protocol):
    """An effect whose size is that at rest, where nothing tells it from friction turning round."""

    def unseen(self, hypothesis: Hypothesis, slow: float) -> float:
        """Part of the size that only shows below a speed [rad/s]: its form alone tells of it."""
        ...


@runtime_checkable
class SaysTwice(Protocol):
    """An effect with a coefficient and a setting that are one number: how far they agree tells."""

    twice: tuple[str, str]


@runtime_checkable
class Judges(Protocol):
    """An effect that knows of values, found by tuning, which it cannot have."""

    def makes_sense(self, hypothesis: Hypothesis, values: Array) -> bool:
        """Whether an effect with these coefficients, of shape (k,), can be meant."""
        ...


@runtime_checkable
class LoadsLink(Protocol):
    """An effect whose torque acts on the link itself, as its weight does."""

    loads_link: bool


@runtime_checkable
class Bends(Protocol):
    """An effect whose form is one of several: how far another one moves its values is in doubt."""

    def bent(self, hypothesis: Hypothesis, values: Array) -> Hypothesis:
        """The same in another form, for coefficients of shape (k,); further terms come last."""
        ...


@runtime_checkable
class Restates(Protocol):
    """An effect that people know by other numbers than those that its columns are made with."""

    def restated(self, hypothesis: Hypothesis, values: dict[str, Value]) -> dict[str, Value]:
        """The parameters as they are reported."""
        ...
