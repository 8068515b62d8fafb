"""Joint refit of links, friction and effects under the pseudo-inertia constraints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.base_parameters import BaseMap, base_map
from ident.dynamics.parameters import Terms
from ident.estimation.feasible_sdp import feasible, nearest_to_cad
from ident.estimation.feasible_set import feasible_set, link_sizes
from ident.estimation.problem import Active, Problem, prior_parameters
from ident.estimation.regression_data import posture
from ident.gap.data.experiment import Experiment
from ident.gap.regression.weighted_fit import Fit, solve
from ident.model.arm import Arm
from ident.model.identified_model import Model

Array = NDArray[np.floating]

_TIE = 1e-13  # of the largest entry: keeps the triangle of a rounding-tight fit real


@dataclass(frozen=True)
class FeasibleModel:
    """A physically possible arm.

    Attributes:
        terms: what the model holds beside the links.
        standard: all parameters, in the order of `ident.dynamics.parameters`, shape (p,).
        inertial: the links' part, shape (10 n,).
        viscous: shape (n,).
        coulomb: shape (n,).
        effects: coefficients of each effect beside them.
        x: the same as unknowns of the fit.
        sd: of the base parameters, were nothing constrained, shape (k,).
        base: what the links' unknowns stand for.
        active: constraints that hold the solution.
    """

    terms: Terms
    standard: Array
    inertial: Array
    viscous: Array
    coulomb: Array
    effects: list[Array]
    x: Array
    sd: Array
    base: BaseMap
    active: tuple[Active, ...]


def friction_terms(arm: Arm) -> Terms:
    """Links with viscous and Coulomb friction at the joints."""
    return Terms(
        viscous=True,
        coulomb=True,
        offset=False,
        rotor_inertia=False,
        drive_matrix=arm.terms.drive_matrix,
        motor_friction=False,
    )


def feasible_fit(
    source: Experiment, model: Fit, base_size: int, near_cad: bool = False
) -> FeasibleModel:
    """The possible parameters nearest to a fit, in units of its noise.

    The effects' coefficients are left free; what they explain is projected off first. A trusted
    model stays as it is; only the joints' friction beside it is the fit's.

    Args:
        source: the arm, and where its joints were.
        model: the free solution.
        base_size: number of base inertial parameters.
        near_cad: choose what the data leave open nearest to CAD, as `ident run` does; else it is
            anything possible, which moves the arm alike.
    """
    if source.trusted is not None:
        return _trusted(source, source.trusted, model)
    arm = source.arm
    terms = friction_terms(arm)
    base = base_map(arm.robot, terms, [posture(d) for d in source.datasets])
    n, b = arm.robot.dof, base_size
    order = np.array(_places(base, b, n))
    rest = np.arange(b + 2 * n, len(model.x))
    right = model.normal @ model.x
    inner = model.normal[np.ix_(order, order)]
    target = right[order]
    across = model.normal[np.ix_(rest, order)]
    own = model.normal[np.ix_(rest, rest)]
    if len(rest):
        back = solve(own, np.column_stack([across, right[rest]]))
        inner = inner - across.T @ back[:, :-1]
        target = target - across.T @ back[:, -1]
    rows = int(model.counts.sum())
    problem = _problem(source, base, inner, target, rows)
    found = feasible(problem)
    if near_cad:
        found = nearest_to_cad(problem, found)
    delta = np.zeros(len(base.parameters)) if found.delta is None else found.delta
    x = np.zeros(len(model.x))
    x[order] = found.beta
    effects = np.zeros(0)
    if len(rest):
        effects = solve(own, right[rest] - across @ found.beta)
        x[rest] = effects
    widths = [s.width for s in model.choice.slots]
    kinds = [p.kind for p in base.parameters]
    return FeasibleModel(
        terms,
        delta,
        delta[[k == "inertial" for k in kinds]],
        delta[[k == "fv" for k in kinds]],
        delta[[k == "fc" for k in kinds]],
        np.split(effects, np.cumsum(widths)[:-1]) if widths else [],
        x,
        _spread(inner),
        base,
        found.active,
    )


def _trusted(source: Experiment, known: Model, model: Fit) -> FeasibleModel:
    n = source.arm.robot.dof
    terms = friction_terms(source.arm)
    return FeasibleModel(
        terms,
        known.delta,
        known.inertial,
        np.maximum(model.x[:n], 0.0),
        np.maximum(model.x[n : 2 * n], 0.0),
        model.effects,
        model.x,
        np.zeros(0),
        base_map(source.arm.robot, terms, [posture(d) for d in source.datasets]),
        (),
    )


def _spread(inner: Array) -> Array:
    """Standard deviations from weighted inner products."""
    return np.sqrt(np.maximum(np.diag(solve(inner, np.eye(len(inner)))), 0.0))


def _places(base: BaseMap, size: int, n: int) -> list[int]:
    """Place of each base parameter among the fit's unknowns: links, viscous, Coulomb."""
    link, order = 0, []
    for p in base.kept_parameters:
        if p.kind == "inertial":
            order.append(link)
            link += 1
        else:
            order.append(size + p.index - 1 + (n if p.kind == "fc" else 0))
    if link != size:
        raise ValueError(f"{link} base parameters of the links, and {size} in the fit")
    return order


def _problem(source: Experiment, base: BaseMap, inner: Array, target: Array, rows: int) -> Problem:
    """The reduced regression whose triangle has these inner products; its error is one per row."""
    beta = solve(inner, target)
    square = float(target @ beta) + rows
    whole = np.block([[inner, target[:, None]], [target[None, :], np.array([[square]])]])
    values, vectors = np.linalg.eigh(whole)
    values = np.maximum(values, _TIE * values[-1])
    triangle = np.linalg.qr(np.sqrt(values)[:, None] * vectors.T).R
    prior = prior_parameters(source.arm.robot, base)
    sizes = link_sizes(prior, base.parameters)
    constraints = feasible_set(base.parameters, sizes, "pseudo_inertia")
    return Problem(base, triangle, rows, prior, sizes, constraints)
