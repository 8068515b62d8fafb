"""Is there a possible arm behind these base parameters? By certificate, and by the mass matrix.

A beta is feasible when at least one delta in D maps to it (paper, III). The test asks for the delta
whose worst constraint has the largest margin; a negative margin comes with a dual certificate: a
linear combination of base parameters that is positive for every possible arm, and negative for this
one.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ident.dynamics.base_parameters import BaseMap
from ident.dynamics.parameters import Terms
from ident.estimation.conic import inside, solve
from ident.estimation.feasible_sdp import free_moves, parameter_scale
from ident.estimation.feasible_set import (
    Constraint,
    LinkSize,
    link_constraints,
    packed,
    sign_constraints,
    smallest_eigenvalue,
)
from ident.estimation.problem import with_beta
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot, with_parameters

_ROUNDING = 1e-7
_POSTURES = 2000


@dataclass(frozen=True)
class Verdict:
    """Whether a possible arm has these base parameters.

    Attributes:
        feasible: whether one has.
        margin: of the worst link in the best delta, in units of the link's own size; negative:
            impossible.
        smallest_eigenvalue: of all pseudo-inertias of that best delta [kg m^2, kg].
        negative: names of friction parameters that are negative.
        certificate: weights of beta, shape (b,), with certificate @ beta < 0 for an impossible one
            and > 0 for every possible arm; zeros where the links are possible.
    """

    feasible: bool
    margin: float
    smallest_eigenvalue: float
    negative: tuple[str, ...]
    certificate: Array


def verdict(base: BaseMap, beta: Array, prior: Array, sizes: dict[int, LinkSize]) -> Verdict:
    """The exact test, by a semidefinite program.

    Args:
        base: beta = K delta.
        beta: shape (b,).
        prior: delta of the CAD model, shape (p,), which breaks ties.
        sizes: each link's size.

    Raises:
        DataError: the solver gives up.
    """
    parameters = base.parameters
    start = with_beta(base, prior, beta)
    free = [i for i in range(len(parameters)) if i not in base.kept]
    scale = parameter_scale(parameters, sizes)[free]
    moves = free_moves(base) * scale
    links = link_constraints(parameters, sizes, "pseudo_inertia")
    rotors = [k for k in sign_constraints(parameters) if k.text.startswith("ia")]
    unknown = np.eye(len(free) + 1)
    cap = Constraint(0, "margin <= 1", 0, -unknown[-1:], np.array([-1.0]))
    limits = [*(_with_margin(k, moves, start) for k in links + rotors), cap]
    P = np.diag([1e-9] * len(free) + [0.0])
    within = inside(limits, np.zeros(len(unknown)), unknown)
    found = solve(P, -unknown[-1], within, "The feasibility test")
    delta = start + moves @ found.x[:-1]
    margin = float(found.x[-1])
    negative = _negative(start, base)
    possible = margin > -_ROUNDING
    weights = sum(
        k.A.T @ (packed(z) if k.side else z)
        for k, z in zip(links + rotors, found.multipliers, strict=False)
    )
    certificate = np.zeros(len(base.kept)) if possible else np.asarray(weights)[list(base.kept)]
    return Verdict(
        possible and not negative,
        margin,
        smallest_eigenvalue(delta, parameters),
        negative,
        certificate,
    )


def proves_possible(delta: Array, base: BaseMap) -> bool:
    """Whether the parameters themselves, shape (p,), are a possible arm's, friction included."""
    links = smallest_eigenvalue(delta, base.parameters) >= 0
    return bool(links and all((k.A @ delta >= 0).all() for k in sign_constraints(base.parameters)))


def _with_margin(constraint: Constraint, moves: Array, start: Array) -> Constraint:
    """The constraint on (moves, margin) instead of delta, less the margin."""
    identity = packed(np.eye(constraint.side)) if constraint.side else np.ones(1)
    A = np.column_stack([constraint.A @ moves, -identity])
    return replace(constraint, A=A, b=-constraint.A @ start)


def _negative(delta: Array, base: BaseMap) -> tuple[str, ...]:
    """Friction parameters below zero. They are base parameters of their own, whatever the links."""
    return tuple(
        p.name
        for i, p in enumerate(base.parameters)
        if p.kind in ("fv", "fc", "fvm", "fcm") and i in base.kept and delta[i] < 0
    )


def positive_fraction(
    robot: Robot, terms: Terms, base: BaseMap, delta: Array, moving: NDArray[np.bool_]
) -> float:
    """Share of random postures over the whole joint range with a positive mass matrix.

    The mass matrix depends on beta only, so that any delta of it serves (paper, V-D). Held joints
    stay at zero, and only the rows and columns of moving joints count.

    Args:
        robot: kinematics and joint limits.
        terms: the drive matrix, for rotor inertia.
        base: names of the parameters.
        delta: shape (p,); its masses must not be zero.
        moving: which joints move, shape (n,).
    """
    inertial = [i for i, p in enumerate(base.parameters) if p.kind == "inertial"]
    model = with_parameters(robot, delta[inertial]).model
    rotors = np.zeros(robot.dof)
    for value, p in zip(delta, base.parameters, strict=True):
        if p.kind == "ia":
            rotors[p.index - 1] = value
    armature = terms.drive_matrix.T @ np.diag(rotors) @ terms.drive_matrix
    rng = np.random.default_rng(0)
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    bounded = np.isfinite(lower) & np.isfinite(upper)
    q = (
        rng.uniform(
            np.where(bounded, lower, -np.pi),
            np.where(bounded, upper, np.pi),
            (_POSTURES, robot.dof),
        )
        * moving
    )
    data = model.createData()
    upper = np.triu([pin.crba(model, data, posture) for posture in q])
    matrices = upper + np.swapaxes(np.triu(upper, 1), 1, 2) + armature
    chosen = matrices[:, moving][:, :, moving]
    return float(np.mean(np.linalg.eigvalsh(chosen)[:, 0] > 0))
