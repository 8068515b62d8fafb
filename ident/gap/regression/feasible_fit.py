"""The physically possible arm nearest to a fit: links, friction and effects together."""

from dataclasses import dataclass, replace

import numpy as np

from ident.dynamics.base_parameters import BaseMap, base_map
from ident.dynamics.parameters import Terms
from ident.estimation.entropic import entropic_path
from ident.estimation.feasible_sdp import feasible, nearest_to_cad
from ident.estimation.feasible_set import feasible_set, link_sizes
from ident.estimation.problem import Active, Estimate, Problem, prior_parameters
from ident.estimation.regression_data import posture
from ident.gap.data.experiment import Experiment
from ident.gap.regression.projection import project_off_with_torque
from ident.gap.regression.weighted_fit import Fit, solve
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_TIE = 1e-13  # of the largest entry: keeps the triangle of a rounding-tight fit real


@dataclass(frozen=True)
class FeasibleModel:
    """A physically possible arm with its effects.

    Attributes:
        terms: friction terms of the model.
        standard: all parameters, in the order of `ident.dynamics.parameters`, shape (p,).
        inertial: the links' part, shape (10 n,).
        viscous: shape (n,).
        coulomb: shape (n,).
        effects: coefficients of each effect.
        x: all of these as unknowns of the fit.
        sd: standard errors of the base parameters without constraints, shape (k,).
        base: map from all parameters to base parameters.
        active: active constraints of the solution.
        note: how the parameters were found, if not by the semidefinite program.
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
    note: str = ""


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
    """The physically possible parameters nearest to a fit, in units of its noise.

    The effects' coefficients are not constrained; their columns are projected off first. With a
    reference model the links stay as it knows them, and the rest is taken from the fit.

    Args:
        source: the arm, and where its joints were.
        model: the free solution.
        base_size: number of base inertial parameters.
        near_cad: choose parameters that the data do not determine nearest to CAD, as `ident run`
            does; otherwise they are arbitrary, which does not change the motion.
    """
    if source.reference_model is not None:
        return _beside_reference(source, source.reference_model, model, base_size)
    arm = source.arm
    terms = friction_terms(arm)
    base = base_map(arm.robot, terms, [posture(d) for d in source.datasets])
    n, b = arm.robot.dof, base_size
    order = np.array(_order(base, b, n))
    rest = np.arange(b + 2 * n, len(model.x))
    right = model.normal @ model.x
    inner, target = model.normal[np.ix_(order, order)], right[order]
    own, across = model.normal[np.ix_(rest, rest)], model.normal[np.ix_(rest, order)]
    if len(rest):
        inner, target = project_off_with_torque(own, across, inner, (right[rest], target))
    problem = _problem(source, base, inner, target, int(model.counts.sum()))
    found, note = _possible(problem, near_cad)
    delta = np.zeros(len(base.parameters)) if found.delta is None else found.delta
    x = np.zeros(len(model.x))
    x[order] = found.beta
    if len(rest):
        x[rest] = solve(own, right[rest] - across @ found.beta)
    kinds = [p.kind for p in base.parameters]
    return FeasibleModel(
        terms,
        delta,
        delta[[k == "inertial" for k in kinds]],
        delta[[k == "fv" for k in kinds]],
        delta[[k == "fc" for k in kinds]],
        replace(model, x=x).effects,
        x,
        _standard_errors(inner),
        base,
        found.active,
        note,
    )


def _possible(problem: Problem, near_cad: bool) -> tuple[Estimate, str]:
    """Possible parameters, and how they were found if the semidefinite program fails.

    A search is never lost for want of a solver: the entropic fit needs none, and CAD always exists.
    """
    try:
        found = feasible(problem)
        return (nearest_to_cad(problem, found) if near_cad else found), ""
    except DataError as error:
        reason = str(error).rstrip(".")
    base, prior = problem.base, problem.prior
    try:
        return entropic_path(problem)[-1], f"{reason}: the links are those of an entropic fit."
    except DataError:
        return Estimate(base.K @ prior, prior), f"{reason}: the links are those of the CAD model."


def _beside_reference(source: Experiment, known: Model, model: Fit, b: int) -> FeasibleModel:
    terms, inertial = friction_terms(source.arm), known.inertial
    inertial[known.undetermined] = model.x[:b]
    return FeasibleModel(
        terms,
        known.delta,
        inertial,
        np.maximum(model.viscous, 0.0),
        np.maximum(model.coulomb, 0.0),
        model.effects,
        model.x,
        np.zeros(0),
        base_map(source.arm.robot, terms, [posture(d) for d in source.datasets]),
        (),
    )


def _standard_errors(inner: Array) -> Array:
    """Standard errors from weighted inner products."""
    return np.sqrt(np.maximum(np.diag(solve(inner, np.eye(len(inner)))), 0.0))


def _order(base: BaseMap, size: int, n: int) -> list[int]:
    """Index of each base parameter among the fit's unknowns: links, viscous, Coulomb."""
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
    """The reduced regression with these inner products and an error of one per row."""
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
