"""What MuJoCo holds of the identified arm joint by joint, and what it has no place for."""

from dataclasses import dataclass

import numpy as np

from ident.effects.simulated_model import without_effects
from ident.export.left_out import LeftOut, effects_left_out, exported_arm
from ident.export.linear_torque import linear_torque
from ident.export.speed_torque import (
    YieldingDamper,
    falls_with_speed,
    hangs_on_speed,
    speed_torque,
    yielding_dampers,
)
from ident.model.identified_model import Model
from ident.signals.arrays import Array
from ident.simulation.arm import Term

_HELD = (
    *("chain", "delta", "armature", "viscous", "friction_rows", "coulomb"),
    *("gain", "limit", "delay_s", "encoder_zero"),
)
_FASTEST = 10.0  # rad/s: of a joint without a limit of speed


@dataclass(frozen=True)
class MujocoJoints:
    """Friction, springs and motors, joint by joint and between joints.

    Attributes:
        friction, damping, armature: of each joint, shape (n,).
        offset, stiffness: torque that the drives must overcome: offset + stiffness q, shape (n,).
        zero: true position less the encoder's [rad], shape (n,).
        gain: torques that act per torques asked for, shape (n, n).
        limit: of the torque asked for [N m], shape (n,).
        delay: after which it acts [s], shape (n,).
        tendons: coefficients of joints, shape (n,), with armature, damping and frictionloss.
        dampers: by joint.
    """

    friction: Array
    damping: Array
    armature: Array
    offset: Array
    stiffness: Array
    zero: Array
    gain: Array
    limit: Array
    delay: Array
    tendons: list[tuple[Array, float, float, float]]
    dampers: list[list[YieldingDamper]]

    @property
    def integrator(self) -> str:
        """MuJoCo's name of it: implicit in damping, unless friction falls as a joint speeds up.

        A slope that falls would take from the inertia that implicit steps divide by.
        """
        falls = map(falls_with_speed, self.dampers, self.damping)
        return "Euler" if any(falls) else "implicitfast"


def mujoco_joints(model: Model) -> MujocoJoints:
    """The model with those of its effects that MuJoCo has a place for."""
    exported, plain = exported_arm(model), without_effects(model)
    arm, n = exported.arm, model.robot.dof
    linear = [linear_torque(term, n) for term in exported.terms]
    known = [x for x in linear if x is not None]
    bent = [t for t, x in zip(exported.terms, linear, strict=True) if x is None]
    by_speed = [speed_torque([t for t in bent if t.joint == j], j, n) for j in range(n)]
    fastest = model.robot.model.velocityLimit
    tendons = _shared_motors(model)
    extra = arm.coulomb[len(plain.coulomb) :], arm.friction_rows[len(plain.coulomb) :]
    tendons += [(row, 0.0, 0.0, float(level)) for level, row in zip(*extra, strict=True)]
    armature = np.diag(_armature(model)) + arm.armature - plain.armature
    if not _passive(armature):
        armature = np.diag(_armature(model))
    damping = np.diag(arm.viscous) + sum((x.damping for x in known), np.zeros((n, n)))
    own_armature, shared = _split(armature)
    tendons += [(row, size, 0.0, 0.0) for row, size in shared]
    own_damping, shared = _split(damping)
    tendons += [(row, 0.0, size, 0.0) for row, size in shared]
    return MujocoJoints(
        arm.coulomb[:n] + [torque.dry for torque in by_speed],
        own_damping,
        own_armature,
        model.parameter("fo") + sum((x.offset for x in known), np.zeros(n)),
        sum((x.stiffness for x in known), np.zeros(n)),
        arm.encoder_zero,
        arm.gain,
        arm.limit,
        arm.delay_s if (arm.delay_s >= 0.0).all() else np.zeros(n),
        tendons,
        [
            yielding_dampers(torque, float(v) if 0.0 < v < np.inf else _FASTEST)
            for torque, v in zip(by_speed, fastest, strict=True)
        ],
    )


def _split(matrix: Array) -> tuple[Array, list[tuple[Array, float]]]:
    """A symmetric matrix as the joints' own entries, and rows r with sizes s: the sum of s r r^T.

    Joints that share nothing keep their entry on the diagonal.
    """
    coupled = (np.abs(matrix - np.diag(np.diag(matrix))) > 0.0).any(axis=0)
    own = np.where(coupled, 0.0, np.diag(matrix))
    sizes, rows = np.linalg.eigh(matrix - np.diag(own))
    shared = [(row, float(s)) for s, row in zip(sizes, rows.T, strict=True) if s > 1e-12]
    return own, shared


def _passive(matrix: Array) -> bool:
    return bool(np.linalg.eigvalsh(matrix).min() >= -1e-12)


def _shared_motors(model: Model) -> list[tuple[Array, float, float, float]]:
    """The model's own motors that turn with several joints."""
    rows, found = model.terms.drive_matrix, []
    inertia, viscous, coulomb = (model.parameter(kind) for kind in ("ia", "fvm", "fcm"))
    for m in (motor - 1 for motor in model.terms.coupled_motors):
        if inertia[m] or viscous[m] or coulomb[m]:
            found.append((rows[m], float(inertia[m]), float(viscous[m]), float(coulomb[m])))
    return found


def _armature(model: Model) -> Array:
    """Inertia at each joint of the rotors that drive it alone [kg m^2], shape (n,)."""
    inertia = model.parameter("ia")
    matrix = model.terms.drive_matrix
    single = (matrix != 0).sum(axis=1) == 1
    return (inertia[:, None] * matrix**2)[single].sum(axis=0)


def left_out_of_joints(model: Model) -> list[LeftOut]:
    """Effects that MuJoCo holds in part or not at all."""
    n, plain = model.robot.dof, without_effects(model)
    arm, held = exported_arm(model).arm, set(_HELD)
    if not _passive(arm.armature - plain.armature + np.diag(_armature(model))):
        held.remove("armature")
    if (arm.delay_s < 0.0).any():
        held.remove("delay_s")

    def writes(term: Term) -> bool:
        return linear_torque(term, n) is not None or hangs_on_speed(term, n)

    return effects_left_out(model, held, writes)
