"""Whether a motor that is moved to and fro answers as the model says: sign, size, and encoder.

At one frequency, friction acts in phase with the velocity and inertia in phase with the
acceleration. So the torque in phase with the motion tells the motor's scale, whatever the friction.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wamctl.arm.arrays import Array
from wamctl.arm.robot import Robot
from wamctl.arm.transmission import Transmission

LEAST_MOTION = 0.25
"""Share of the wanted motion below which a motor has not moved: friction leaves more of it."""
SCALE = (0.5, 1.6)
"""Where a motor's torque over the commanded one must lie: a tool of 2 kg that the model does not
know, friction that sticks and the CAD's own error look like a scale, too."""


@dataclass(frozen=True)
class Response:
    """How one motor answered.

    Attributes:
        motion: its motion over the wanted one, in phase with it; negative for the other direction.
        scale: lowest and highest torque that its motion shows over the commanded one, without and
            with the rotors' inertia, which models often leave out; 1 in a healthy arm.
        torque_nm: amplitude of the model's torque in phase with the motion, motor side [N m].
    """

    motion: float
    scale: tuple[float, float]
    torque_nm: float


@dataclass(frozen=True)
class ResponseRecord:
    """Samples of whole periods of a motor's motion; time is axis 0, joints axis 1.

    Attributes:
        phase: of the wanted motion at each sample, shape (S,) [rad].
        q_ref: wanted position [rad].
        q: measured position [rad].
        tau: joint torque that acts around each sample [N m].
        rate_rad_s: angular frequency of the motion [rad/s].
    """

    phase: Array
    q_ref: Array
    q: Array
    tau: Array
    rate_rad_s: float


def response(
    robot: Robot,
    transmission: Transmission,
    rotors: Array,
    record: ResponseRecord,
    motor: int,
) -> Response:
    """How a motor answered to its own motion.

    Args:
        robot: rigid-body model.
        transmission: motors and joints.
        rotors: inertia of each motor's rotor, motor side, shape (n,) [kg m^2].
        record: whole periods.
        motor: its place (0, 1, ...).
    """
    wave = np.exp(-1j * record.phase) * 2.0 / len(record.phase)
    wanted, moved, torque = (wave @ values for values in (record.q_ref, record.q, record.tau))
    needed = _stiffness(robot, record.q.mean(axis=0), record.rate_rad_s) @ moved
    angle_ref = (transmission.motor_from_joint @ wanted)[motor]
    angle = (transmission.motor_from_joint @ moved)[motor]
    given = (torque @ transmission.joint_from_motor)[motor]
    asked = (needed @ transmission.joint_from_motor)[motor]
    direction = angle / max(abs(angle), 1e-12)
    links, commanded = (asked * direction.conj()).real, (given * direction.conj()).real
    rotor = -rotors[motor] * record.rate_rad_s**2 * abs(angle)
    motion = (angle * angle_ref.conj()).real / abs(angle_ref) ** 2
    shown = sorted(torque / (commanded or 1e-12) for torque in (links, links + rotor))
    return Response(float(motion), (float(shown[0]), float(shown[1])), float(abs(links)))


def _stiffness(robot: Robot, q: Array, rate_rad_s: float) -> Array:
    """Torque per small motion at a frequency: gravity's gradient less inertia, shape (n, n)."""
    data = robot.data()
    mass = pin.crba(robot.model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    gravity = pin.computeGeneralizedGravityDerivatives(robot.model, data, q)
    return gravity - rate_rad_s**2 * mass


def fault(found: Response, motor: int, least_torque_nm: float) -> str | None:
    """Why a motor's answer is not that of a healthy one, as the start of a sentence; or None.

    Args:
        found: its answer.
        motor: its place (0, 1, ...).
        least_torque_nm: below this torque in phase, friction hides the motor's scale [N m].
    """
    name = f"motor {motor + 1}"
    if found.motion < LEAST_MOTION:
        return (
            f"{name} made {found.motion:+.2f} of the small motion that it was told to make (limit "
            f"{LEAST_MOTION:g}): look at its sign, its encoder, its wiring and its assignment"
        )
    low, high = SCALE
    if found.torque_nm > least_torque_nm and (found.scale[1] < low or found.scale[0] > high):
        nearest = found.scale[1] if found.scale[1] < low else found.scale[0]
        return (
            f"{name} gives {nearest:.2f} times the torque that it is told to give (limits {low:g} "
            f"and {high:g}): look at its ratio, its torque constant and its load"
        )
    return None
