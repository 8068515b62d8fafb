"""The feasible fit as it stands in the paper, (36)-(44), in cvxpy: to read, extend and solve.

Minimise ||rho1 - R1 beta||^2, the part of (33) that beta decides, subject to beta = K delta and
E(delta) - epsilon I >= 0, (38). Constraints and priors can be added, and any solver of cvxpy
chosen. The direct path in `feasible_sdp` hands the same program to Clarabel without a modelling
layer, some twenty times faster; a test holds both equal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cvxpy as cp
import numpy as np
from cvxpy.error import SolverError

from ident.dynamics.base_parameters import BaseMap
from ident.estimation.feasible_sdp import free_moves, parameter_scale
from ident.estimation.feasible_set import Constraint, unpacked
from ident.estimation.problem import Estimate, Problem, least_error, ordinary, with_beta
from wamctl.arm.errors import ConfigurationError, DataError

_BOX = 1e3
"""Bound of the dependent parameters, in units of each link's size: many delta have the same beta,
and an interior-point solver needs a bounded set."""


@dataclass(frozen=True)
class FeasibleProgram:
    """The semidefinite program (44).

    Attributes:
        base: beta = K delta.
        delta: standard parameters, an expression of shape (p,).
        error: the objective: what the fit adds to the least error, in units of it.
        constraints: the feasible set, and what was added to it.
    """

    base: BaseMap
    delta: cp.Expression
    error: cp.Expression
    constraints: tuple[cp.Constraint, ...]

    def parameter(self, name: str) -> cp.Expression:
        """A standard parameter by its name, such as `m4` or `fc2`.

        Raises:
            DataError: there is none of this name; the sentence lists all.
        """
        names = [p.name for p in self.base.parameters]
        if name not in names:
            raise DataError(f"There is no parameter {name}; there are {', '.join(names)}.")
        return self.delta[names.index(name)]

    @property
    def beta(self) -> cp.Expression:
        """Base parameters K delta, an expression of shape (b,)."""
        return self.base.K @ self.delta

    def subject_to(self, *constraints: cp.Constraint) -> "FeasibleProgram":
        """The same with further constraints."""
        return replace(self, constraints=(*self.constraints, *constraints))

    def with_prior(self, penalty: cp.Expression) -> "FeasibleProgram":
        """The same with a convex penalty beside the error, which is in units of the least error."""
        return replace(self, error=self.error + penalty)

    def solve(self, solver: str = "CLARABEL") -> Estimate:
        """The solution.

        Args:
            solver: one of cvxpy's that knows semidefinite cones, such as CLARABEL or SCS.

        Raises:
            ConfigurationError: no such solver is installed.
            DataError: the solver finds no feasible parameters.
        """
        if solver not in cp.installed_solvers():
            raise ConfigurationError(
                "solver",
                [f"{solver} is not installed; there are {', '.join(cp.installed_solvers())}"],
            )
        program = cp.Problem(cp.Minimize(self.error), list(self.constraints))
        try:
            program.solve(solver=solver)
        except SolverError as error:
            raise DataError(f"{solver} cannot solve the feasible fit ({error}).") from error
        if program.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE) or self.delta.value is None:
            raise DataError(f"The feasible fit has no solution: {solver} says {program.status}.")
        delta = np.asarray(self.delta.value)
        seconds = program.solver_stats.solve_time if program.solver_stats else None
        return Estimate(
            self.base.K @ delta, delta, status=program.status, seconds=float(seconds or 0.0)
        )


def feasible_program(problem: Problem) -> FeasibleProgram:
    """The program (44) of a regression.

    The unknowns are R1 (beta - beta_ols) and the dependent parameters, each in its own unit, so
    that solvers meet numbers near one.

    Args:
        problem: the reduced regression (32) and the set D.
    """
    base = problem.base
    kept = list(base.kept)
    free = [i for i in range(len(base.parameters)) if i not in kept]
    scale = parameter_scale(base.parameters, problem.sizes)
    start = with_beta(base, problem.prior, ordinary(problem))
    of_fit = np.zeros((len(scale), len(kept)))
    of_fit[kept] = np.linalg.inv(problem.R[:-1, :-1]) * np.sqrt(least_error(problem))
    residual = cp.Variable(len(kept), name="residual")
    dependent = cp.Variable(len(free), name="dependent")
    delta = start + of_fit @ residual + (free_moves(base) * scale[free]) @ dependent
    limits = [cp.abs(dependent) <= _BOX, *_in_cones(problem.constraints, delta)]
    return FeasibleProgram(base, delta, cp.sum_squares(residual), tuple(limits))


def _in_cones(constraints: Sequence[Constraint], delta: cp.Expression) -> list[cp.Constraint]:
    """Each constraint of the set D on delta: an inequality, or a positive semidefinite matrix."""
    limits: list[cp.Constraint] = []
    for k in constraints:
        room = k.A @ delta - k.b
        if k.side:
            basis = [unpacked(unit, k.side).ravel() for unit in np.eye(len(k.b))]
            matrix = cp.reshape(np.array(basis).T @ room, (k.side, k.side), order="C")
            limits.append(matrix >> 0)
        else:
            limits.append(room >= 0)
    return limits
