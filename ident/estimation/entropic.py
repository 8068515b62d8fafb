"""Feasible least squares with an entropic prior: CAD decides what the data leave open.

The distance of a link to its CAD is tr(P0^-1 P) - log det(P0^-1 P) - 4 for pseudo-inertias P and
P0: the Bregman divergence of the log-determinant, which no change of frame alters, and which grows
without bound as a link ceases to be possible (Lee, Wensing, Park 2020). It is its own barrier, so
that Newton's method solves the fit without a semidefinite program. Friction has no CAD: x / x0 -
log(x / x0) - 1 with the size x0 of its OLS value keeps it positive.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.dynamics.parameters import NON_NEGATIVE
from ident.estimation.feasible_set import LinkSize, link_places, links_of
from ident.estimation.problem import Estimate, Problem, least_error, ordinary, with_beta
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import from_pseudo_inertia, pseudo_inertia

WEIGHTS = tuple(10.0**-k for k in range(7))
"""Weights of the prior relative to the least error, from strong to weak."""

_MOST_STEPS = 60
_DECREMENT = 1e-4
_SHORTEST = 1e-9
_SMALLEST_PRIOR = 1e-3
_SMALLEST_FRICTION = 1e-3


@dataclass(frozen=True)
class _Coordinates:
    """delta = T v, with each link's v the entries of its pseudo-inertia in units of its CAD.

    Attributes:
        T: shape (p, p).
        links: per link the places of its ten entries.
        positive: places of friction and rotor inertia.
    """

    T: Array
    links: list[list[int]]
    positive: list[int]


def entropic_path(problem: Problem, weights: Sequence[float] = WEIGHTS) -> list[Estimate]:
    """The fit for each weight of the prior, each started from the one before.

    The path ends early where the prior has become too weak for Newton's method.

    Args:
        problem: the reduced regression; of its set D only the pseudo-inertias count.
        weights: descending.

    Raises:
        DataError: not even the strongest prior leads to an answer.
    """
    start = time.perf_counter()
    coordinates = _coordinates(problem)
    error = least_error(problem)
    G = problem.R[:-1, :-1] @ problem.base.K @ coordinates.T / np.sqrt(error)
    y = problem.R[:-1, :-1] @ ordinary(problem) / np.sqrt(error)
    v = _identity(coordinates, len(problem.base.parameters))
    estimates = []
    for weight in weights:
        found = _minimum(G, y, weight, v, coordinates)
        if found is None:
            break
        v = found
        delta = coordinates.T @ v
        seconds = time.perf_counter() - start
        note = f"weight of the prior {weight:.0e}"
        estimates.append(Estimate(problem.base.K @ delta, delta, (), "Solved", seconds, note))
    if not estimates:
        raise DataError("The entropic fit does not converge.")
    return estimates


def _coordinates(problem: Problem) -> _Coordinates:
    parameters = problem.base.parameters
    found = with_beta(problem.base, problem.prior, ordinary(problem))
    T = np.diag(np.maximum(np.abs(found), _SMALLEST_FRICTION))
    links = [link_places(parameters, k) for k in links_of(parameters)]
    for k, places in zip(links_of(parameters), links, strict=True):
        root = np.linalg.cholesky(_prior_matrix(problem.prior[places], problem.sizes[k]))
        columns = [from_pseudo_inertia(root @ e @ root.T) for e in _BASIS]
        T[np.ix_(places, places)] = np.column_stack(columns)
    positive = [i for i, p in enumerate(parameters) if p.kind in NON_NEGATIVE]
    return _Coordinates(T, links, positive)


def _prior_matrix(delta: Array, size: LinkSize) -> Array:
    """Pseudo-inertia of a link's CAD, a little rounder than drawn, or of a ball of its size."""
    ball = size.mass * np.diag([size.radius**2 / 3] * 3 + [1.0])
    drawn = pseudo_inertia(delta)
    if np.linalg.eigvalsh(drawn)[0] <= 0:
        return ball
    return (1 - _SMALLEST_PRIOR) * drawn + _SMALLEST_PRIOR * ball


def _symmetric_basis() -> Array:
    """The ten symmetric 4 x 4 matrices with one entry, shape (10, 4, 4)."""
    basis = np.zeros((10, 4, 4))
    for k, (i, j) in enumerate(zip(*np.triu_indices(4), strict=True)):
        basis[k, i, j] = basis[k, j, i] = 1.0
    return basis


_BASIS = _symmetric_basis()


def _identity(coordinates: _Coordinates, count: int) -> Array:
    """CAD links, and friction of its OLS size."""
    v = np.zeros(count)
    for places in coordinates.links:
        v[places] = [b.trace() / np.count_nonzero(b) for b in _BASIS]
    v[coordinates.positive] = 1.0
    return v


def _minimum(
    G: Array, y: Array, weight: float, v: Array, coordinates: _Coordinates
) -> Array | None:
    """Newton's method on ||G v - y||^2 + weight * prior, from a v that is inside.

    None where it takes too many steps.
    """
    H_data = 2 * G.T @ G

    def cost(at: Array) -> float:
        return float(np.sum((G @ at - y) ** 2)) + weight * _prior_value(at, coordinates)

    for _ in range(_MOST_STEPS):
        g_prior, H_prior = _prior_slopes(v, coordinates)
        g = 2 * G.T @ (G @ v - y) + weight * g_prior
        step = _newton_step(H_data + weight * H_prior, g)
        decrement = float(-g @ step)
        if decrement < _DECREMENT * weight:
            return v
        v = v + _step_length(cost, v, step, decrement) * step
    return None


def _newton_step(H: Array, g: Array) -> Array:
    """-H^-1 g; what nothing depends on (a held joint's offset) stays where it is."""
    ridge = 1e-14 * np.trace(H) / len(H)
    return -np.linalg.solve(H + ridge * np.eye(len(H)), g)


def _step_length(cost: Callable[[Array], float], v: Array, step: Array, decrement: float) -> float:
    """The first of 1, 1/2, 1/4 and so on that lowers the cost by its share."""
    now, length = cost(v), 1.0
    while length > _SHORTEST and cost(v + length * step) > now - 0.1 * length * decrement:
        length /= 2
    return length


def _prior_value(v: Array, coordinates: _Coordinates) -> float:
    matrices = np.einsum("lk,kij->lij", v[np.array(coordinates.links)], _BASIS)
    friction = v[coordinates.positive]
    if np.linalg.eigvalsh(matrices).min() <= 0 or (friction.size and friction.min() <= 0):
        return np.inf
    divergence = np.trace(matrices, axis1=1, axis2=2) - np.linalg.slogdet(matrices)[1]
    return float(divergence.sum() + np.sum(friction - np.log(friction)))


def _prior_slopes(v: Array, coordinates: _Coordinates) -> tuple[Array, Array]:
    """Gradient and Hessian of the prior."""
    places = np.array(coordinates.links)
    inverse = np.linalg.inv(np.einsum("lk,kij->lij", v[places], _BASIS))
    gradient, hessian = np.zeros(len(v)), np.zeros((len(v), len(v)))
    traces = np.trace(_BASIS, axis1=1, axis2=2)
    products = np.einsum("lij,kjm->lkim", inverse, _BASIS)
    for link, product in zip(places, products, strict=True):
        gradient[link] = traces - np.trace(product, axis1=1, axis2=2)
        hessian[np.ix_(link, link)] = np.einsum("aij,bji->ab", product, product)
    friction = coordinates.positive
    gradient[friction] = 1 - 1 / v[friction]
    hessian[friction, friction] = 1 / v[friction] ** 2
    return gradient, hessian
