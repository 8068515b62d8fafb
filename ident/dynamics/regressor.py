"""The regressor of (6), column by column: links, friction, rotors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.dynamics.parameters import Parameter, Terms
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot
from wamctl.arm.robot import regressor as link_regressor

SHARP = ("fc", "fcm")
"""Kinds whose columns jump with the sign of a velocity."""


@dataclass(frozen=True)
class Motion:
    """Joint position [rad], velocity [rad/s], and acceleration [rad/s^2], each of shape (S, n)."""

    q: Array
    qd: Array
    qdd: Array


def all_columns(
    robot: Robot, terms: Terms, motion: Motion, parameters: Sequence[Parameter]
) -> Array:
    """Columns of any parameters, shape (S, n, p): torque [N m] per unit of each."""
    smooth = [i for i, p in enumerate(parameters) if p.kind not in SHARP]
    sharp = [i for i, p in enumerate(parameters) if p.kind in SHARP]
    columns = np.empty((*motion.q.shape, len(parameters)))
    columns[..., smooth] = smooth_columns(robot, terms, motion, [parameters[i] for i in smooth])
    columns[..., sharp] = sharp_columns(terms, motion.qd, [parameters[i] for i in sharp])
    return columns


def smooth_columns(
    robot: Robot, terms: Terms, motion: Motion, parameters: Sequence[Parameter]
) -> Array:
    """Columns of the parameters that do not jump, shape (S, n, p): torque [N m] per unit of each.

    Args:
        robot: kinematics, frames, and gravity.
        terms: the drive matrix.
        motion: S samples of n joints.
        parameters: the p wanted ones, none of a kind in `SHARP`.
    """
    place = {name: i for i, name in enumerate(robot.inertial_names)}
    inertial = [i for i, p in enumerate(parameters) if p.kind == "inertial"]
    others = [i for i, p in enumerate(parameters) if p.kind != "inertial"]
    wanted = [place[parameters[i].name] for i in inertial]
    links = link_regressor(robot, motion.q, motion.qd, motion.qdd, wanted)
    drives = [_drive_column(terms, motion, parameters[i])[..., None] for i in others]
    columns = np.concatenate([links, *drives], axis=2)
    together = inertial + others
    return columns if together == sorted(together) else columns[..., np.argsort(together)]


def sharp_columns(terms: Terms, qd: Array, parameters: Sequence[Parameter]) -> Array:
    """Columns of Coulomb friction, shape (S, n, p): the sign of the velocity it acts on, (3).

    Args:
        terms: the drive matrix.
        qd: joint velocity [rad/s] from which the sign is taken, shape (S, n).
        parameters: the p wanted ones, all of a kind in `SHARP`.
    """
    columns = np.zeros((*qd.shape, len(parameters)))
    for i, parameter in enumerate(parameters):
        row = _row(terms, parameter)
        columns[:, :, i] = np.sign(qd @ row)[:, None] * row
    return columns


def _drive_column(terms: Terms, motion: Motion, parameter: Parameter) -> Array:
    row = _row(terms, parameter)
    match parameter.kind:
        case "fv" | "fvm":
            return (motion.qd @ row)[:, None] * row
        case "ia":
            return (motion.qdd @ row)[:, None] * row
        case "fo":
            return np.broadcast_to(row, motion.q.shape)
        case _:
            raise ValueError(f"{parameter.name} has no smooth column")


def _row(terms: Terms, parameter: Parameter) -> Array:
    """How the speed that the parameter acts on comes from the joints' speeds, shape (n,)."""
    on_motor = parameter.kind in ("ia", "fvm", "fcm")
    matrix = terms.drive_matrix if on_motor else np.eye(len(terms.drive_matrix))
    return matrix[parameter.index - 1]
