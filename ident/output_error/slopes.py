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
    rows = np.flatnonzero(free.any(axis=1))
    steps = np.zeros((len(rows), *settings.shape))
    for k, row in enumerate(rows):
        steps[k, row] = reach * (_NUDGE if QUANTITIES[row].scale == 0.0 else _PART)
    return _along(setup, settings, free, steps * free)


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
    place, each = coordinates(settings), np.arange(settings.shape[1])
    felt = np.any(steps[:, [ROW[name] for name in _REACHING]], axis=1)
    asked = []
    for k, step in enumerate(steps):
        groups = [*(each == j for j in np.flatnonzero(felt[k])), ~felt[k]]
        asked += [(k, g & step.any(axis=0)) for g in groups if step[:, g].any()]
    ends = [
        np.where(free, settings_at(place + side * steps[k] * g), settings)
        for k, g in asked
        for side in (1.0, -1.0)
    ]
    left = setup.residuals_of(ends)
    told: list[list[tuple[Array, Array]]] = [[] for _ in each]
    for i, (k, group) in enumerate(asked):
        way = coordinates(ends[2 * i]) - coordinates(ends[2 * i + 1])
        change = left[2 * i + 1] - left[2 * i]
        for j in np.flatnonzero(group):
            own = change if felt[k, j] else np.where(each == j, change, 0.0)
            told[j].append((way[free[:, j], j], own))
    made, joints = np.zeros((int(free.sum()), *left[0].shape)), np.argwhere(free)[:, 1]
    for j in np.unique(joints):
        ways, changes = (np.array(some) for some in zip(*told[j], strict=True))
        solved = np.linalg.lstsq(ways, changes.reshape(len(changes), -1), rcond=None)[0]
        made[joints == j] = solved.reshape(-1, *changes.shape[1:])
    return made
