"""Feasible least squares: the semidefinite program (44), in its reduced form (32)-(36).

Clarabel takes the quadratic objective as it is, so that the matrix U of (43) is not needed. The
unknowns start at the (mostly impossible) parameter set of the OLS solution, so that the objective
starts at zero, in units of the OLS error.
"""

from dataclasses import replace

import numpy as np

from ident.dynamics.base_parameters import BaseMap
from ident.dynamics.parameters import Parameter
from ident.estimation.conic import Solution, inside, solve
from ident.estimation.feasible_set import MARGIN, Constraint, LinkSize, unpacked
from ident.estimation.problem import Active, Estimate, Problem, least_error, ordinary, with_beta
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

TIE_BREAK = 1e-11
"""Weight of the distance to CAD: it keeps the solver from wandering where the data say nothing."""

_ACTIVE = 1e-5
_ATTEMPTS = 4
_RIDGE = 1e-14
_CAD_WEIGHT = 1e-8
_SMALLEST_FRICTION = 1e-3


def feasible(problem: Problem, prior_weight: float = TIE_BREAK) -> Estimate:
    """The possible parameters with the least error, (44).

    The solver's answer is checked against every constraint. Where it misses one, the distance to
    CAD gets ten times the weight, until the answer is inside.

    Args:
        problem: the reduced regression and the set D.
        prior_weight: of the squared distance to CAD, in units of each link's size, relative to the
            OLS error.

    Raises:
        DataError: the solver finds no possible parameters.
    """
    for weight in prior_weight * 10.0 ** np.arange(_ATTEMPTS):
        estimate = _solved(problem, float(weight))
        if estimate.delta is not None and holds(problem.constraints, estimate.delta):
            return estimate
    raise DataError("The feasible fit ends outside of what is possible.")


def holds(constraints: list[Constraint], delta: Array) -> bool:
    """Whether delta keeps every constraint, using up less than the margin of (38)."""
    for side in {k.side for k in constraints}:
        alike = [k for k in constraints if k.side == side]
        rooms = [k.A @ delta - k.b for k in alike]
        if not side:
            worst = np.concatenate(rooms).min()
        else:
            worst = np.linalg.eigvalsh(unpacked(np.array(rooms), side)).min()
        if worst <= -MARGIN:
            return False
    return True


def _solved(problem: Problem, prior_weight: float) -> Estimate:
    base, parameters = problem.base, problem.base.parameters
    scale = parameter_scale(parameters, problem.sizes)
    start = with_beta(base, problem.prior, ordinary(problem))
    error = least_error(problem)
    T = _change_of_variables(problem, scale, error)
    b = len(base.kept)
    weights = np.full(len(T), _RIDGE)
    weights[:b] = 1.0
    known = [p.kind == "inertial" for i, p in enumerate(parameters) if i not in base.kept]
    weights[b:] += prior_weight * np.array(known)
    within = inside(problem.constraints, start, T)
    found = solve(2 * np.diag(weights), np.zeros(len(T)), within, "The feasible fit", refined=False)
    delta = start + T @ found.x
    active = active_constraints(problem.constraints, found, error)
    return Estimate(base.K @ delta, delta, active, found.status, found.seconds)


def _change_of_variables(problem: Problem, scale: Array, error: float) -> Array:
    """What makes delta of the unknowns, beta and delta_d of (29)-(31) in their units, shape (p, p).

    The first b are R1 (beta - beta_ols), whose squared length is what the fit adds to the error;
    the others are the dependent parameters. The objective is then as well conditioned as can be.
    """
    base = problem.base
    kept = list(base.kept)
    free = [i for i in range(len(scale)) if i not in base.kept]
    of_beta = np.zeros((len(scale), len(kept)))
    of_beta[kept] = np.linalg.inv(problem.R[:-1, :-1]) * np.sqrt(error)
    return np.column_stack([of_beta, free_moves(base) * scale[free]])


def nearest_to_cad(problem: Problem, estimate: Estimate) -> Estimate:
    """The possible model nearest to CAD among those that fit as the estimate does, (45).

    The squared torque of a change of beta, relative to the OLS error, stands beside the distance
    to CAD with a tiny weight: beta stays, but for a change far below its standard error, and CAD
    decides what the data leave open. Where the solver gives up, the estimate stays as it is.
    """
    if estimate.delta is None:
        return estimate
    base = problem.base
    scale = parameter_scale(base.parameters, problem.sizes)
    G = problem.R[:-1, :-1] @ (base.K * scale)
    known = np.array([p.kind == "inertial" for p in base.parameters], dtype=float)
    P = 2 * (G.T @ G) / least_error(problem) + 2 * np.diag(_CAD_WEIGHT * known + _RIDGE)
    c = 2 * _CAD_WEIGHT * known * (estimate.delta - problem.prior) / scale
    within = inside(problem.constraints, estimate.delta, np.diag(scale))
    try:
        found = solve(P, c, within, "The search for the model nearest to CAD")
    except DataError:
        return estimate  # as feasible as before; only the part without effect is not CAD's
    delta = estimate.delta + scale * found.x
    if not holds(problem.constraints, delta):
        return estimate
    return replace(estimate, beta=base.K @ delta, delta=delta)


def free_moves(base: BaseMap) -> Array:
    """Changes of delta that beta does not feel, one per dependent parameter, shape (p, p - b)."""
    unit = np.eye(len(base.parameters))
    free = [i for i in range(len(base.parameters)) if i not in base.kept]
    return unit[:, free] - unit[:, base.kept] @ base.K[:, free]


def parameter_scale(parameters: tuple[Parameter, ...], sizes: dict[int, LinkSize]) -> Array:
    """Size of each entry of delta, shape (p,), so that the solver's unknowns are all near one."""
    scale = np.full(len(parameters), _SMALLEST_FRICTION)
    powers = {"kg m^2": 2, "kg m": 1, "kg": 0}
    for i, p in enumerate(parameters):
        if p.kind == "inertial":
            size = sizes[p.index]
            scale[i] = size.mass * size.radius ** powers[p.unit]
    return scale


def active_constraints(
    constraints: list[Constraint], found: Solution, error: float
) -> tuple[Active, ...]:
    """Constraints whose multiplier counts beside the error, the strongest first."""
    active = []
    for constraint, z in zip(constraints, found.multipliers, strict=True):
        if constraint.side:
            values, vectors = np.linalg.eigh(z)
            strength, words = float(values[-1]), _direction(vectors[:, -1])
        else:
            strength, words = float(z.max()), ""
        if strength > _ACTIVE:
            active.append(Active(constraint.joint, constraint.text, strength * error, words))
    return tuple(sorted(active, key=lambda a: -a.multiplier))


def _direction(vector: Array) -> str:
    """Where a link's matrix has no room left: its mass, or its extent along an axis."""
    if abs(vector[3:]).max() > abs(vector[:3]).max():
        return "no mass left"
    axis = vector[:3] / np.linalg.norm(vector[:3])
    axis *= np.sign(axis[np.argmax(np.abs(axis))])
    return "no extent along ({:.2f}, {:.2f}, {:.2f})".format(*axis)
