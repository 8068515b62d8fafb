"""What a motion is worth, once it keeps its limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.excitation.optimisation.deadline import Deadline
from ident.excitation.optimisation.scale_into_limits import fit
from ident.excitation.problem.closed_loop_trial import ClosedLoopTrial
from ident.excitation.problem.criterion import sharp_condition, sharp_errors
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.regressor_columns import exact_rows
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

POOL = 6
"""So many motions are worth keeping."""

UNSEEN = 100.0
"""A motion that was not tried is behind all that were, whatever the formula promises. It is not
where its condition number passes the bound."""

_SURPRISE = 0.1
"""A motion may catch up by so much, in the logarithm, when it is tried out once more."""


@dataclass(frozen=True)
class Candidate:
    """A motion within its limits.

    Attributes:
        rest: what the condition number adds to its value; as much as `UNSEEN` more, where something
            is still to be seen of it.
        tries: what the standard errors add is the mean of these: by the formula, or of each try of
            a trial.
        condition_number: of W, whatever the objective.
        coefficients: shape (2 L + 1, n).
    """

    rest: float
    tries: tuple[float, ...]
    condition_number: float
    coefficients: Array

    @property
    def value(self) -> float:
        """Of the sharp objective: the logarithm of the condition number, for example."""
        return self.after(len(self.tries))

    def after(self, tries: int) -> float:
        """The value by the first tries alone."""
        return self.rest + float(np.mean(self.tries[:tries]))

    def behind(self) -> "Candidate":
        """The same, of which something is still to be seen."""
        return replace(self, rest=self.rest + UNSEEN)


@dataclass(frozen=True)
class Judge:
    """Brings motions into their limits, and says what they are worth.

    Attributes:
        problem: with a dense grid.
        deadline: no motion is tried after it.
    """

    problem: Problem
    deadline: Deadline

    def of(self, coefficients: Array, kept: Sequence[Candidate]) -> list[Candidate]:
        """The motion made small enough, or nothing where that fails or others are surely better.

        Args:
            coefficients: shape (2 L + 1, n).
            kept: what it competes with, best first.
        """
        fitted = fit(self.problem, coefficients)
        if fitted is None:
            return []
        found = candidate(self.problem, fitted)
        if self.problem.trial is None:
            return [found]
        if found.condition_number > self.problem.objective.most:
            return [found.behind()]
        if self.deadline.over:
            return [] if kept else [found.behind()]
        try:
            return self._tried(self.problem.trial, found, kept)
        except DataError:
            return [found.behind()]

    def _tried(
        self, trial: ClosedLoopTrial, found: Candidate, kept: Sequence[Candidate]
    ) -> list[Candidate]:
        """The motion as the tries show it; nothing as soon as all kept ones are clearly better."""
        worst = kept[-1] if len(kept) >= POOL else None
        if worst is not None:
            least = min(float(np.mean(k.tries)) for k in kept)
            if found.rest + least > worst.value + _SURPRISE:
                return []
        tries: tuple[float, ...] = ()
        for errors in trial.errors(found.coefficients):
            tries = (*tries, errors)
            found = replace(found, tries=tries)
            if worst is not None and found.value > worst.after(len(tries)) + _SURPRISE:
                return []
        return [found]


def candidate(problem: Problem, coefficients: Array) -> Candidate:
    """A motion with what it is worth on the problem's grid, by the formula for its noise."""
    motion = problem.grid.motion(coefficients)
    rows, variance = exact_rows(problem.columns, motion), problem.noise.variance(motion)
    errors = sharp_errors(problem.objective, rows, variance.T.ravel())
    rest = sharp_condition(problem.objective, rows)
    return Candidate(rest, (errors,), float(np.linalg.cond(rows)), coefficients)
