"""Base parameters: independent columns, and how the rest regroups into them, (11)-(13), (21)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.parameters import Parameter, Terms, standard_parameters
from ident.dynamics.regressor import Motion, all_columns
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot

_TOLERANCE = 1e-4
"""A column depends on those before it when less than this part of its length is left over: a base
that hangs by 3.1416 leaves some millionths of a column that an upright one has not."""

_DIGITS = 1e-3
"""Part of the longest column below which a column says only how an angle of the URDF was rounded:
a base on its side by 1.57 lets gravity pull at joint 1 by a thousandth, one that hangs by 3.14159
by a millionth. What links can have gives columns 26 times as long and longer, on ten arms."""

_PRINTED = 1e-5
_ZERO = 1e-9
_SAMPLES = 60


@dataclass(frozen=True)
class BaseMap:
    """beta = K delta.

    Attributes:
        parameters: the p entries of delta.
        kept: places in delta of the b independent parameters, ascending.
        K: the map of (21), shape (b, p); its kept columns are the identity.
        names: the b parameter combinations, as Table I prints them.
        units: their units.
    """

    parameters: tuple[Parameter, ...]
    kept: tuple[int, ...]
    K: Array
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def kept_parameters(self) -> tuple[Parameter, ...]:
        """The parameter that each row of beta is named after."""
        return tuple(self.parameters[i] for i in self.kept)


@dataclass(frozen=True)
class Posture:
    """Where a joint may be when the structure of the regressor is sampled.

    Attributes:
        centre: position of each joint [rad], shape (n,).
        reach: how far each joint moves from there [rad], shape (n,); zero holds it.
    """

    centre: Array
    reach: Array

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Which joints move, shape (n,)."""
        return self.reach > 0


def whole_range(dof: int) -> Posture:
    """Every joint anywhere on its circle."""
    return Posture(np.zeros(dof), np.full(dof, np.pi))


def base_map(robot: Robot, terms: Terms, postures: Sequence[Posture]) -> BaseMap:
    """The base parameters of the arm, or of the part of it that moves.

    The first independent columns in the order of (8) are kept, as in Table I. Only rows of moving
    joints count, so that a held joint's own parameters appear only where a moving joint feels them.

    Args:
        robot: kinematics, frames, and gravity.
        terms: friction and rotors.
        postures: one for each recording, since held joints may be held elsewhere in each.
    """
    parameters = standard_parameters(robot, terms)
    rows = np.concatenate([_structure(robot, terms, parameters, p) for p in postures])
    kept, Q = independent_columns(rows)
    K = np.linalg.solve(Q.T @ rows[:, kept], Q.T @ rows)
    K[np.abs(K) < _ZERO] = 0.0
    K[:, kept] = np.eye(len(kept))
    names = tuple(combination_name(row, parameters) for row in K)
    return BaseMap(parameters, tuple(kept), K, names, tuple(parameters[i].unit for i in kept))


def _structure(
    robot: Robot, terms: Terms, parameters: tuple[Parameter, ...], posture: Posture
) -> Array:
    """Regressor at random motions, rows of moving joints only, shape (rows, p)."""
    rng = np.random.default_rng(0)
    shape = (_SAMPLES, robot.dof)
    moving = posture.moving
    q = posture.centre + posture.reach * rng.uniform(-1, 1, shape)
    qd, qdd = rng.uniform(-1, 1, (2, *shape)) * moving
    columns = all_columns(robot, terms, Motion(q, qd, qdd), parameters)
    return columns[:, moving].reshape(-1, len(parameters))


def independent_columns(rows: Array) -> tuple[list[int], Array]:
    """The first independent columns from the left, and an orthonormal base of their space.

    Each column is compared with its own length, after taking off what the kept columns before it
    explain (twice, which keeps Gram-Schmidt orthogonal to rounding). Columns that are nothing
    beside the longest one never count.
    """
    lengths = np.linalg.norm(rows, axis=0)
    base = np.empty((len(rows), 0))
    kept = []
    for i in np.flatnonzero(lengths > _DIGITS * lengths.max()):
        rest = rows[:, i] / lengths[i]
        for _ in range(2):
            rest = rest - base @ (base.T @ rest)
        left = np.linalg.norm(rest)
        if left > _TOLERANCE:
            kept.append(int(i))
            base = np.column_stack([base, rest / left])
    return kept, base


def combination_name(coefficients: Array, parameters: Sequence[Parameter]) -> str:
    """A row of K in words: `L1yy + L2zz`, `l4x - 0.045 (m4 +m5 +m6 +m7)`.

    Without what comes of the rounded angles of a URDF, such as `3.7e-06 l3z`.
    """
    exact = [float(f"{c:.10g}") for c in coefficients]  # a tie must not hang on rounding errors
    values = [float(f"{c:.6g}") for c in exact]
    text = ""
    done: set[int] = set()
    for i, value in enumerate(values):
        if abs(value) < _PRINTED or i in done:
            continue
        alike = [i]
        if _is_mass(parameters[i]):
            alike = [j for j, v in enumerate(values) if v == value and _is_mass(parameters[j])]
        done.update(alike)
        term = _term(abs(value), [parameters[j].name for j in alike], _is_mass(parameters[i]))
        sign = "-" if value < 0 else "+"
        text += f" {sign} {term}" if text else ("-" if value < 0 else "") + term
    return text


def _is_mass(parameter: Parameter) -> bool:
    return parameter.unit == "kg" and parameter.kind == "inertial"


def _term(size: float, names: list[str], mass: bool) -> str:
    one = size == 1.0
    if len(names) > 1:
        group = f"({' +'.join(names)})"
        return group if one else f"{size:.6g} {group}"
    if one:
        return names[0]
    return f"{size:.6g}{names[0]}" if mass else f"{size:.6g} {names[0]}"
