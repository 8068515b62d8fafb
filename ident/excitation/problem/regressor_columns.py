"""The columns of W that a design looks at: base parameters as Table I groups them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.base_parameters import BaseMap, base_map, whole_range
from ident.dynamics.parameters import Parameter, Terms
from ident.dynamics.regressor import Motion, sharp_columns, smooth_columns
from ident.dynamics.regressor_adjoint import Frames, fill_rows, frames_of
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot, cad_parameters


@dataclass(frozen=True)
class Columns:
    """The b independent columns: those of the links first, then friction, rotors and offsets.

    Attributes:
        robot: kinematics, frames and gravity.
        terms: what the model holds beside the links, per joint.
        parameters: the b parameters that the columns are named after.
        frames: the links' kinematics for the compiled columns.
        links: how many columns are the links'.
        first: per joint the first column that its torque can depend on, shape (n,).
        cad: the links' base parameters of the CAD model, shape (links,).
    """

    robot: Robot
    terms: Terms
    parameters: tuple[Parameter, ...]
    frames: Frames
    links: int
    first: NDArray[np.int64]
    cad: Array

    @property
    def own(self) -> list[tuple[int, str, int]]:
        """Column, kind and joint (from 0) of each parameter that belongs to a joint alone."""
        pairs = enumerate(self.parameters)
        return [(i, p.kind, p.index - 1) for i, p in pairs if p.kind != "inertial"]


def joint_terms(dof: int, wanted: tuple[str, ...]) -> Terms:
    """Terms that act on each joint by itself, as in Table I and in the later study's 69.

    Args:
        dof: number of joints n.
        wanted: of viscous, coulomb, offset and rotor_inertia.
    """
    names = ("viscous", "coulomb", "offset", "rotor_inertia")
    chosen = {name: name in wanted for name in names}
    return Terms(**chosen, drive_matrix=np.eye(dof), motor_friction=False)


def columns_of(robot: Robot, terms: Terms) -> Columns:
    """The independent columns of an arm.

    Args:
        robot: kinematics, frames and gravity.
        terms: what the model holds beside the links, per joint.
    """
    found = base_map(robot, terms, [whole_range(robot.dof)])
    inertial = [p for p in found.kept_parameters if p.kind == "inertial"]
    others = [p for p in found.kept_parameters if p.kind != "inertial"]
    place = {name: i for i, name in enumerate(robot.inertial_names)}
    wanted = np.array([place[p.name] for p in inertial])
    first = [sum(p.index < joint for p in inertial) for joint in range(1, robot.dof + 1)]
    return Columns(
        robot,
        terms,
        tuple(inertial + others),
        frames_of(robot, wanted),
        len(inertial),
        np.array(first),
        _cad(robot, found),
    )


def _cad(robot: Robot, found: BaseMap) -> Array:
    standard = dict(zip(robot.inertial_names, cad_parameters(robot), strict=True))
    delta = np.array([standard.get(p.name, 0.0) for p in found.parameters])
    kept = [p.kind == "inertial" for p in found.kept_parameters]
    return (found.K @ delta)[kept]


def smooth_rows(columns: Columns, motion: Motion, softness_rad_s: float) -> Array:
    """W with a sign that is smooth, tanh(qd / softness), shape (n, S, b).

    Args:
        columns: the wanted columns.
        motion: S samples of n joints.
        softness_rad_s: width of the smoothed sign [rad/s].
    """
    samples, n = motion.q.shape
    rows = np.zeros((n, samples, len(columns.parameters)))
    fill_rows(columns.frames, motion.q, motion.qd, motion.qdd, rows)
    for i, kind, joint in columns.own:
        match kind:
            case "fv":
                rows[joint, :, i] = motion.qd[:, joint]
            case "fc":
                rows[joint, :, i] = np.tanh(motion.qd[:, joint] / softness_rad_s)
            case "ia":
                rows[joint, :, i] = motion.qdd[:, joint]
            case _:
                rows[joint, :, i] = 1.0
    return rows


def exact_rows(columns: Columns, motion: Motion) -> Array:
    """W by Pinocchio and with the sharp sign of (3), stacked: shape (S n, b)."""
    sharp = [p for p in columns.parameters if p.kind == "fc"]
    smooth = [p for p in columns.parameters if p.kind != "fc"]
    found = np.concatenate(
        [
            smooth_columns(columns.robot, columns.terms, motion, smooth),
            sharp_columns(columns.terms, motion.qd, sharp),
        ],
        axis=2,
    )
    return found.reshape(-1, len(columns.parameters))
