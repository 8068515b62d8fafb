"""Torque per ampere of each joint, where efforts are currents.

i_k = g_k (Y_k beta) + friction of joint k. A link's parameters appear in the rows of all joints
that carry it, so that the motion itself tells the ratios of the gains (least squares in beta and g
by turns); one factor of all of them stays open, and the weight that CAD states fixes it, as in
Gautier and Briot (2014), who use a known payload.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.estimation.regression_data import RegressionData, reduce_recordings
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array

Source = Literal["given", "links", "weight", "load", "none"]

_STRETCHES = 12
_PASSES = 2
"""Curves of reversals are chosen again once the joints agree on their links."""

_ROUNDS = 3000
_SETTLED = 1e-7
_RIDGE = 1e-10
_EXACT = 1e-9
"""Least share of the squared current that counts as noise."""


@dataclass(frozen=True)
class DriveGains:
    """Torque per ampere.

    Attributes:
        value: of each joint [N m/A], shape (n,).
        relative_sd: its standard error beside it, shape (n,), that of the common factor in it;
            infinite where nothing tells it: `value` is then the common factor.
        common_sd: relative standard error of the factor that all have in common; infinite where
            nothing fixes it: one ampere of the strongest joint then counts as 1 N m.
        source: what each is known from: the arm's file, link parameters that joints share, the
            masses in the URDF, a known load, or nothing.
    """

    value: Array
    relative_sd: Array
    common_sd: float
    source: tuple[Source, ...]


@dataclass(frozen=True)
class Ratios:
    """Current per torque of each joint beside that of one of them.

    Attributes:
        value: shape (n,).
        relative_sd: its standard error beside it, shape (n,); infinite for joints that do not move.
    """

    value: Array
    relative_sd: Array


def coupled_ratios(data: Sequence[Dataset], arm: Arm, reference: int) -> Ratios:
    """Ratios of the gains from the parameters that joints share.

    Args:
        data: recordings whose torque are currents [A].
        arm: the robot and its settings.
        reference: the joint whose gain counts as one, from 0.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    found = Ratios(np.ones(arm.robot.dof), np.zeros(arm.robot.dof))
    for _ in range(_PASSES):
        alike = [d.with_torque_times(1 / found.value) for d in data]
        more = _of_evidence(reduce_recordings(alike, arm), reference)
        found = Ratios(found.value * more.value, more.relative_sd)
    return found


def _of_evidence(evidence: RegressionData, reference: int) -> Ratios:
    triangles = evidence.fitted_triangles
    stretches = triangles.reshape(-1, *triangles.shape[2:])
    grams = np.einsum("snij,snik->snjk", stretches, stretches)
    group = np.arange(len(grams)) * _STRETCHES // len(grams)
    parts = np.array([grams[group == s].sum(axis=0) for s in range(_STRETCHES)])
    whole = parts.sum(axis=0)
    found = _ratios(evidence, whole, reference)
    without = [_ratios(evidence, whole - part, reference) for part in parts]
    logs = np.log(np.maximum(np.abs(without), 1e-300))
    spread = (_STRETCHES - 1) / _STRETCHES * np.sum((logs - logs.mean(axis=0)) ** 2, axis=0)
    return Ratios(found, np.where(evidence.moving, np.sqrt(spread), np.inf))


def _ratios(evidence: RegressionData, grams: Array, reference: int) -> Array:
    """The ratios from inner products of [W | current] of each joint, shape (n, b + 1, b + 1)."""
    joints = np.flatnonzero(evidence.moving).tolist()
    bare = np.array([_links_only(evidence, grams[k]) for k in joints])
    A, a, square = bare[:, :-1, :-1], bare[:, :-1, -1], bare[:, -1, -1]
    length = np.sqrt(np.einsum("kjj->j", A))
    A, a = A / np.outer(length, length), a / length
    noise = [s - y @ _solved(X, y) for X, y, s in zip(A, a, square, strict=True)]
    weights = 1 / np.maximum(noise, _EXACT * square)
    g = np.ones(len(joints))
    for _ in range(_ROUNDS):
        beta = _solved(np.einsum("k,kij->ij", weights * g**2, A), (weights * g) @ a)
        new = (a @ beta) / np.einsum("i,kij,j->k", beta, A, beta)
        new, last = new / np.sqrt(np.mean(new**2)), g
        g = new
        if np.abs(g - last).max() < _SETTLED:
            break
    ratios = np.ones(len(grams))
    ratios[joints] = g / g[joints.index(reference)]
    return ratios


def _links_only(
    evidence: RegressionData,
    gram: Array,
) -> Array:
    """Inner products of the links' columns and the current beside the joint's own friction."""
    kept = evidence.base.kept_parameters
    links = [i for i, p in enumerate(kept) if p.kind == "inertial"]
    own = [i for i, p in enumerate(kept) if p.kind != "inertial" and gram[i, i] > 0]
    rest = [*links, len(kept)]
    C = gram[np.ix_(own, rest)]
    return gram[np.ix_(rest, rest)] - C.T @ _solved(gram[np.ix_(own, own)], C)


def _solved(A: Array, y: Array) -> Array:
    """Least squares by normal equations; zero for what the data leave open."""
    return np.linalg.solve(A + _RIDGE * max(np.trace(A), 1e-300) * np.eye(len(A)) / len(A), y)
