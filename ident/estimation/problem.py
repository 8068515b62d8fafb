"""What every estimator gets: the reduced regression, the base map, and what is known beforehand."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.base_parameters import BaseMap
from ident.estimation.feasible_set import Constraint, LinkSize
from ident.regression.triangles import least_squares, squared_error
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.robot import Robot, cad_parameters

_LEAST_SHARE = 1e-8
"""Of the squared torque: data with less error count as if they had it, or no solver could scale."""

_UNDETERMINED = 1e-13
"""Of the largest singular value of scaled normal equations."""


@dataclass(frozen=True)
class Problem:
    """Minimise ||tau - W beta||^2 with beta = K delta and delta in D, (20).

    Attributes:
        base: beta = K delta.
        R: triangle of [W | tau], rows perhaps weighted, shape (b + 1, b + 1).
        rows: number of rows behind it.
        prior: delta of the CAD model, friction zero, shape (p,).
        sizes: each link's size.
        constraints: the set D.
    """

    base: BaseMap
    R: Array
    rows: int
    prior: Array
    sizes: dict[int, LinkSize]
    constraints: list[Constraint]


@dataclass(frozen=True)
class Active:
    """A constraint that holds the solution.

    Attributes:
        joint: link, joint, or motor, from 1.
        constraint: in words.
        multiplier: how much ||tau - W beta||^2 [N^2 m^2] falls per unit by which the bound is
            lowered (SI unit for friction, the link's own size for its matrix).
        direction: for a matrix, where the mass distribution has become thin.
    """

    joint: int
    constraint: str
    multiplier: float
    direction: str = ""


@dataclass(frozen=True)
class Estimate:
    """One estimator's answer.

    Attributes:
        beta: base parameters, shape (b,).
        delta: standard parameters with beta = K delta, shape (p,), where the estimator has them.
        active: constraints that hold it.
        status: the solver's word.
        seconds: time spent [s].
        note: what else is worth telling.
    """

    beta: Array
    delta: Array | None = None
    active: tuple[Active, ...] = ()
    status: str = ""
    seconds: float = 0.0
    note: str = ""


def prior_parameters(robot: Robot, base: BaseMap) -> Array:
    """CAD values of delta, shape (p,); zero where CAD says nothing (friction, rotors)."""
    known = dict(zip(robot.inertial_names, cad_parameters(robot), strict=True))
    return np.array([known.get(p.name, 0.0) for p in base.parameters])


def with_beta(base: BaseMap, delta: Array, beta: Array) -> Array:
    """The delta that maps to beta and keeps the dependent parameters of another, shape (p,)."""
    kept = list(base.kept)
    result = delta.copy()
    result[kept] = 0.0
    result[kept] = beta - base.K @ result
    return result


def ordinary(problem: Problem) -> Array:
    """The OLS solution (16), shape (b,)."""
    return least_squares(problem.R)


def least_error(problem: Problem) -> float:
    """u_o of (35): the error that no beta can undercut [N^2 m^2], never quite zero.

    Raises:
        DataError: the torque is zero throughout.
    """
    torque = float(np.sum(problem.R[:, -1] ** 2))
    if torque == 0.0:
        raise DataError("The torque is zero throughout the recording; nothing can be learned.")
    return max(float(squared_error(problem.R, ordinary(problem))), _LEAST_SHARE * torque)


def solved(gram: Array) -> Array:
    """The least squares of normal equations [W | tau]^T [W | tau], columns in their own scale.

    Columns that a recording leaves undetermined, such as those of its held joints, get the smallest
    solution.
    """
    size = np.sqrt(np.diag(gram)[:-1])
    scale = np.where(size > 0.0, size, 1.0)
    normal, right = gram[:-1, :-1] / np.outer(scale, scale), gram[:-1, -1] / scale
    return np.linalg.lstsq(normal, right, rcond=_UNDETERMINED)[0] / scale
