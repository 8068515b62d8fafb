"""Whether a motor that is moved to and fro answers as the model says: sign, size, and encoder.

Friction that slides acts in phase with the velocity, inertia in phase with the acceleration, so
that the torque in phase with the motion tells the motor's scale. Bristles, backlash and a joint
that sticks where it turns round act in phase with the motion, too: but they depend on the way, and
hardly on how fast it is gone, while inertia grows with the square of the rate. So a scale that
looks wrong is looked at again at half the rate: where it is the motor's, it is the same.
"""

import math
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


_SAME = 0.15  # by which the torque over what the motion needs may differ at two rates
_STEP = 3  # samples before and behind, between which an encoder counts enough
_SLIDES = 0.2  # share of its largest speed from which a joint slides
_MOVED = 0.4  # share of its way that a joint must go, so that friction does not hold its load
ANY_SCALE = (0.0, math.inf)
"""What the motion of a motor shows where friction hides its scale: not more than its sign."""


@dataclass(frozen=True)
class Response:
    """How one motor answered.

    Attributes:
        motion: its motion over the wanted one, in phase with it; negative for the other direction.
        given_nm: torque that it was told to give, in phase with its motion [N m].
        needed_nm: what the motion needs by the model, without and with the rotors' inertia, which
            models often leave out, in phase with it and without friction, shape (2,) [N m].
        held_nm: torque that it holds at the joints that it turns: the means of their mean torques
            in both directions, in which friction cancels that slides, and inertia [N m]; not a
            number if one of them did not move.
    """

    motion: float
    given_nm: float
    needed_nm: Array
    held_nm: float


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
    direction = (angle / max(abs(angle), 1e-12)).conj()
    rotor = -rotors[motor] * record.rate_rad_s**2 * abs(angle)
    links = (asked * direction).real
    return Response(
        motion=float((angle * angle_ref.conj()).real / abs(angle_ref) ** 2),
        given_nm=float((given * direction).real),
        needed_nm=np.array([links, links + rotor]),
        held_nm=_held(robot, transmission, record, motor),
    )


def _held(robot: Robot, transmission: Transmission, record: ResponseRecord, motor: int) -> float:
    """Torque that a motor holds at the joints that it turns [N m]."""
    over_s = 2 * _STEP * 2.0 * np.pi / record.rate_rad_s / len(record.phase)
    qd = (record.q[2 * _STEP :] - record.q[: -2 * _STEP]) / over_s
    qdd = (qd[2 * _STEP :] - qd[: -2 * _STEP]) / over_s
    moved, inner = qd[_STEP:-_STEP], slice(2 * _STEP, -2 * _STEP)
    slow = record.tau[inner] - qdd @ _inertia(robot, record.q.mean(axis=0))
    torques, wanted = np.zeros(len(transmission.joint_from_motor)), np.ptp(record.q_ref, axis=0)
    for joint in np.flatnonzero(transmission.joint_from_motor[:, motor]):
        least = _SLIDES * np.abs(moved[:, joint]).max()
        up, down = moved[:, joint] > least, moved[:, joint] < -least
        if np.ptp(record.q[:, joint]) < _MOVED * wanted[joint] or not (up.any() and down.any()):
            return math.nan
        torques[joint] = (slow[up, joint].mean() + slow[down, joint].mean()) / 2.0
    return float(torques @ transmission.joint_from_motor[:, motor])


def shown_scale(fast: Response, slow: Response | None = None) -> tuple[float, float]:
    """Lowest and highest torque that a motor's motion shows over the commanded one; 1 if healthy.

    Args:
        fast: its answer.
        slow: its answer at another rate, where the first may have been one of friction.
    """
    shares = fast.given_nm / fast.needed_nm
    if slow is not None:
        again = slow.given_nm / slow.needed_nm
        if abs(again[0] - shares[0]) > _SAME * max(1.0, abs(shares[0])):
            return ANY_SCALE
        shares = np.concatenate([shares, again])
    low, high = float(np.min(shares)), float(np.max(shares))
    if high <= 0.0:
        return ANY_SCALE
    return 1.0 / high, 1.0 / low if low > 0.0 else math.inf


def _stiffness(robot: Robot, q: Array, rate_rad_s: float) -> Array:
    """Torque per small motion at a frequency: gravity's gradient less inertia, shape (n, n)."""
    mass = _inertia(robot, q)
    gravity = pin.computeGeneralizedGravityDerivatives(robot.model, robot.data(), q)
    return gravity - rate_rad_s**2 * mass


def _inertia(robot: Robot, q: Array) -> Array:
    mass = pin.crba(robot.model, robot.data(), q)
    return np.triu(mass) + np.triu(mass, 1).T


def motion_fault(found: Response, motor: int) -> str | None:
    """Why a motor does not move as it is driven, as the start of a sentence; or None."""
    if found.motion >= LEAST_MOTION:
        return None
    return (
        f"motor {motor + 1} made {found.motion:+.2f} of the small motion that it was told to make "
        f"(limit {LEAST_MOTION:g}): look at its sign, its encoder, its wiring and its assignment"
    )


def scale_fault(shown: tuple[float, float], motor: int) -> str | None:
    """Why a motor's torque is not what it is told to give, as the start of a sentence; or None.

    Args:
        shown: lowest and highest torque that its motion shows over the commanded one.
        motor: its place (0, 1, ...).
    """
    low, high = SCALE
    if shown[1] >= low and shown[0] <= high:
        return None
    return (
        f"motor {motor + 1} gives {shown[1] if shown[1] < low else shown[0]:.2f} times the torque "
        f"that it is told to give (limits {low:g} and {high:g}): look at its ratio, its torque "
        "constant and its load"
    )
