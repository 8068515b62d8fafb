"""The base class of an effect: one thing that a rigid-body model can miss."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from enum import Enum, StrEnum
from typing import Any, ClassVar, Generic

import numpy as np

from ident.effects.candidate import (
    Candidate,
    Coefficient,
    NonlinearParameter,
    NoParameters,
    P,
    Value,
)
from ident.effects.observation import ArmFacts, Observed
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm


class FormUncertainty(Enum):
    """What the form of an effect may get wrong."""

    NONE = "nothing: its equation leaves no freedom"
    SPEED = "a curve over the joint's speed, which follows its direction"
    EITHER_WAY = "a curve over the joint's speed, the same in both directions"
    POSITION = "a curve over the joint's position"
    TIME = "a curve over time, of friction"
    ANY = "anything"


class ExperimentMotion(StrEnum):
    """Motions of the library of `ident design --for`."""

    SLOW_REVERSALS = "slow reversals"
    SPEED_STAIRCASE = "speed staircase"
    FAST_REVERSALS = "fast reversals"
    WIDE_SWEEP = "wide sweep"
    LOAD_CHANGES = "load changes"
    STRETCHED_SWEEP = "stretched sweep"
    CHANGING_DOMINANCE = "changing dominance"
    REPEATED_EXCITATION = "the excitation, repeated for a long time"


class Effect(ABC, Generic[P]):
    """One effect: one file, one class, one object named EFFECT.

    A subclass names itself, and gives `candidates`, `columns` and `simulated`. All else has a
    neutral default: an effect that is linear in its coefficients, acts at the drive, has no memory,
    and whose form may get anything wrong.

    Attributes:
        id: name in the result file.
        title: in plain words.
        equation: added to the joint torque, in the names of its parameters and in all its forms.
        source: where the equation comes from.
        signature: what it looks like in the residual.
        experiment: motion that tells it from its rivals.
        motion: the same as a motion of the library.
        intervention: what the operator may do to the arm where no motion tells it from its rivals.
        rivals: ids of effects that look alike.
        contains: ids of effects that are special cases of it.
        linear: the numbers that multiply its columns, where they are always the same.
        nonlinear: the numbers that shape its columns, in the order of `Parameters`.
        Parameters: NamedTuple of all that shapes its columns.
        needs_reference_model: it shows only against a model that was trusted before.
        form_uncertainty: what is left of an accepted effect may be its form's error.
        band_limited: its columns vary no faster than the links move, so that a lower rate does.
        depends_on: what its columns are formed with, beside the motion: `direction` of friction,
            `model` torque, the model's `friction`, whole `torque`.
        acts_on_link: its torque acts on the link itself, as its weight does.
        acts_on_pairs: it is looked for at pairs of joints, so that one joint alone may lack it.
        linear_in_coefficients: else its columns are formed about some, see `linearised_at`.
        has_memory: its torque depends on the motion before, so that one sample does not tell it.
        usual_term: the term of an arm's settings that holds it for all joints; empty: none does.
        same_number: a coefficient and a nonlinear parameter that are one number.
        taken_for_granted: what its size rests on that these data cannot test, in a sentence.
        asks_of_arm: what the arm's file has to say for it to be searched; empty: nothing.
    """

    id: ClassVar[str]
    title: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    signature: ClassVar[str]
    experiment: ClassVar[str]
    motion: ClassVar[ExperimentMotion] = ExperimentMotion.REPEATED_EXCITATION
    intervention: ClassVar[str] = (
        "hang a known mass on the tool, record the same motion again, and investigate that log"
    )
    rivals: ClassVar[tuple[str, ...]] = ()
    contains: ClassVar[tuple[str, ...]] = ()
    linear: ClassVar[tuple[Coefficient, ...]] = ()
    nonlinear: ClassVar[tuple[NonlinearParameter, ...]] = ()
    Parameters: ClassVar[type] = NoParameters
    needs_reference_model: ClassVar[bool] = False
    form_uncertainty: ClassVar[FormUncertainty] = FormUncertainty.ANY
    band_limited: ClassVar[bool] = False
    depends_on: ClassVar[tuple[str, ...]] = ()
    acts_on_link: ClassVar[bool] = False
    acts_on_pairs: ClassVar[bool] = False
    linear_in_coefficients: ClassVar[bool] = True
    has_memory: ClassVar[bool] = False
    usual_term: ClassVar[str] = ""
    same_number: ClassVar[tuple[str, str] | None] = None
    taken_for_granted: ClassVar[str] = ""
    asks_of_arm: ClassVar[str] = ""

    def candidates(self, arm: ArmFacts) -> list[Candidate[P]]:
        """All places and grid points where the effect may be looked for: each moving joint."""
        return [self.at((j,)) for j in arm.moving_joints]

    @abstractmethod
    def columns(self, seen: Observed, candidate: Candidate[P]) -> Array:
        """Torque per unit of each coefficient, shape (S, len(rows), k)."""

    @abstractmethod
    def simulated(self, arm: SimulatedArm, candidate: Candidate[P], values: Array) -> SimulatedArm:
        """The arm with the effect in, for coefficients of shape (k,)."""

    def coefficients(self, parameters: P, variant: str) -> tuple[Coefficient, ...]:
        """The numbers that multiply its columns, for a shape and a form of it."""
        return self.linear

    def static_columns(self, seen: Observed, candidate: Candidate[P]) -> Array:
        """The same as `columns`, from each sample alone; zeros where only the past tells."""
        if self.has_memory:
            return np.zeros((len(seen.q), len(candidate.rows), len(candidate.coefficients)))
        return self.columns(seen, candidate)

    def linearised_at(self, candidate: Candidate[P], values: Array) -> Candidate[P]:
        """The same with its columns formed about coefficients of shape (k,)."""
        return candidate

    def is_plausible(
        self, candidate: Candidate[P], values: Array, friction: tuple[float, float], tuned: bool
    ) -> bool:
        """Whether an effect with these coefficients can be meant.

        Args:
            candidate: the effect.
            values: its coefficients, shape (k,).
            friction: viscous [N m s/rad] and Coulomb [N m] friction of its first joint in the
                same fit.
            tuned: whether its nonlinear parameters have been refined, or are still of the grid.
        """
        return True

    def alternative_form(self, candidate: Candidate[P], values: Array) -> Candidate[P] | None:
        """The same in another form, by which its values may differ; further terms come last.

        The final model takes that form where its further terms are surely not zero.
        """
        return None

    def final_form(self, candidate: Candidate[P]) -> Candidate[P]:
        """The form that it has once it is found: with terms that its place is found without."""
        return candidate

    def unobserved_fraction(self, candidate: Candidate[P], slow: float) -> float:
        """Part of its size that only shows below a speed [rad/s]: its form alone tells of it."""
        return 0.0

    def memory_distance(self, candidate: Candidate[P]) -> float:
        """Way [rad] over which it forgets where it began; 0: it has nothing to forget."""
        return 0.0

    def equation_of(self, candidate: Candidate[P]) -> str:
        """The equation in the form that a candidate has."""
        return self.equation

    def assumption_of(self, candidate: Candidate[P]) -> str:
        """What is taken for granted of a candidate, in a sentence."""
        return self.taken_for_granted

    def drive_factors(self, candidate: Candidate[P], values: Array) -> dict[int, float]:
        """Factors of a joint's rotor and offset that were known before the effect, by joint.

        Args:
            candidate: the effect.
            values: of its coefficients.
        """
        return {}

    def as_reported(self, candidate: Candidate[P], values: dict[str, Value]) -> dict[str, Value]:
        """The parameters as people know them, from those that the columns are made with."""
        return values

    def at(
        self,
        joints: Sequence[int],
        parameters: P | None = None,
        variant: str = "",
        rows: Sequence[int] | None = None,
    ) -> Candidate[P]:
        """The effect at a place.

        Args:
            joints: the joints named, from 0.
            parameters: what shapes the columns; None where nothing does.
            variant: which of its forms.
            rows: the joints whose torque changes, from 0; None: those named.
        """
        shape = self.Parameters() if parameters is None else parameters
        changed = tuple(joints if rows is None else rows)
        coefficients = self.coefficients(shape, variant)
        return Candidate(self.id, tuple(joints), changed, coefficients, shape, variant)

    def moved(self, candidate: Candidate[P], changes: Mapping[str, float]) -> Candidate[P]:
        """The same at the same place with other parameters."""
        shape: Any = candidate.parameters
        return self.at(
            candidate.joints, shape._replace(**changes), candidate.variant, candidate.rows
        )
