"""What settings do to the simulated positions: differences of whole simulations.

A setting of one joint is taken to move that joint alone (a geared arm's joints hardly feel each
other), so that one simulation serves all joints; zero positions, which turn the gravity of others,
have a simulation each.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.coordinates import coordinates, settings_at
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.setup import MEMORY_S, Prior, Setup
from ident.signals.arrays import Array

SLOPE_STEP_S = 0.002
"""Of searches, and of simulations that are compared with each other; the error of a coarser one
passes for play and planned speed."""

NEAR = 0.3
"""Part of a fit's first reach: where that helps no more, and for what is known at the end."""

_REACHING = ("zero",)  # felt by other joints
_NUDGE = 0.1  # of a logarithm; sticking makes smaller changes uneven
_PART = 0.3  # the same of a quantity's scale
_FARTHEST = 1.0  # in a coordinate
_TURNS = 2


def columns(setup: Setup, settings: Array, free: NDArray[np.bool_], reach: float = NEAR) -> Array:
    """Change of the simulated positions per coordinate, shape (p, S, n), p free ones by rows.

    Changes are made to both sides: the bend of large columns otherwise passes for knowledge where
    they all but cancel, as along a common factor of all torques. Steps are coarse ones, whose error
    is alike.

    Args:
        setup: arm and recordings.
        settings: around which, shape (quantities, n).
        free: of which settings, shape (quantities, n).
        reach: size of the changes, as a part of the largest that a fit makes.
    """
    setup = replace(setup, step=max(setup.step, SLOPE_STEP_S))
    pairs = np.argwhere(free)
    made = []
    for row in np.unique(pairs[:, 0]):
        joints = np.flatnonzero(free[row]).tolist()
        alone = QUANTITIES[row].name in _REACHING
        for group in [[j] for j in joints] if alone else [joints]:
            (ahead, up), (behind, down) = (
                _nudged(settings, row, group, side) for side in (reach, -reach)
            )
            change = setup.residuals(behind) - setup.residuals(ahead)
            for j in group:
                own = change if alone else np.where(np.arange(len(up)) == j, change, 0.0)
                made.append(own / (up - down)[j])
    return np.array(made)


def _nudged(settings: Array, row: int, group: list[int], reach: float) -> tuple[Array, Array]:
    """Settings with one quantity of some joints changed inside its bounds, and by how much.

    The second is in coordinates, shape (n,).
    """
    place = coordinates(settings)
    moved = place.copy()
    moved[row, group] += reach * (_NUDGE if QUANTITIES[row].scale == 0.0 else _PART)
    changed = settings_at(moved)
    return changed, coordinates(changed)[row] - place[row]


def sure_columns(setup: Setup, settings: Array, free: NDArray[np.bool_], prior: Prior) -> Array:
    """The same from changes along the directions of what each joint knows, as far as it is unsure.

    A simulation is uneven, where joints stick above all. Where columns all but cancel, as along a
    common factor of all torques, what is uneven about short changes would pass for knowledge.
    """
    made = columns(setup, settings, free)
    error = np.mean(setup.residuals(settings) ** 2, axis=0)
    weight = setup.seconds / MEMORY_S / made.shape[1] / error
    joints = np.argwhere(free)[:, 1]
    for _ in range(_TURNS):
        steps = np.zeros((free.sum(axis=0).max(), *settings.shape))
        for j in np.unique(joints):
            J, rows = made[joints == j, :, j], np.flatnonzero(free[:, j])
            known, ways = np.linalg.eigh(weight[j] * J @ J.T + np.diag(prior.sd[rows, j] ** -2.0))
            far = ways / np.sqrt(known)
            far /= np.maximum(np.abs(far).max(axis=0) / _FARTHEST, 1.0)
            steps[: len(rows), rows, j] = far.T
        made = _along(setup, settings, free, steps)
    return made


def _along(setup: Setup, settings: Array, free: NDArray[np.bool_], steps: Array) -> Array:
    """Change of the simulated positions per coordinate, from steps of each joint to both sides.

    Args:
        setup: arm and recordings.
        settings: around which, shape (quantities, n).
        free: of which settings, shape (quantities, n).
        steps: in coordinates, shape (K, quantities, n).
    """
    setup = replace(setup, step=max(setup.step, SLOPE_STEP_S))
    place, joints = coordinates(settings), np.argwhere(free)[:, 1]
    made = np.zeros((len(joints), len(setup.residuals(settings)), len(free.T)))
    felt = np.any(free[[ROW[name] for name in _REACHING]], axis=0)
    alone = [np.arange(len(felt)) == j for j in np.flatnonzero(felt)]
    for group in [*alone, ~felt]:
        ways, changes = [], []
        for step in steps:
            ahead, behind = (settings_at(place + side * step * group) for side in (1.0, -1.0))
            ways.append(coordinates(ahead) - coordinates(behind))
            changes.append(setup.residuals(behind) - setup.residuals(ahead))
        for j in np.flatnonzero(group):
            rows = np.flatnonzero(free[:, j])
            own = np.array(changes) * (felt[j] | (np.arange(len(felt)) == j))
            way = np.array(ways)[:, rows, j]
            solved = np.linalg.lstsq(way, own.reshape(len(own), -1), rcond=None)[0]
            made[joints == j] = solved.reshape(len(rows), *own.shape[1:])
    return made
