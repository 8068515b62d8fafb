"""The sampled side of the benchmark's arms: encoders in whole counts, and the torque that follows.

Written for the benchmark alone, as matrix equations: the simulation that it tests shares no line.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain, chain_of, inverse_dynamics, workspace
from wamctl.arm.config import ArmFile
from wamctl.arm.robot import Robot, cad_parameters

Array = NDArray[np.float64]


class Drives(NamedTuple):
    """Drives and controller of n joints.

    Attributes:
        chain, delta: the model that computes the torque.
        kp: acceleration per position error [1/s^2], shape (n,).
        kd: acceleration per velocity error [1/s], shape (n,).
        blend: share of the newest difference in the velocity estimate.
        counts: encoder counts per joint angle [1/rad], shape (n, n).
        angles: its inverse [rad], shape (n, n).
        units: drive's torque units per joint torque [1/(N m)], shape (n, n).
        torques: its inverse [N m], shape (n, n).
        cycle_s: [s].
    """

    chain: Chain
    delta: Array
    kp: Array
    kd: Array
    blend: float
    counts: Array
    angles: Array
    units: Array
    torques: Array
    cycle_s: float


def drives_of(file: ArmFile, nominal: Robot) -> Drives:
    """Drives and controller as the arm's file describes them."""
    pole = np.array(file.controller.bandwidth_rad_s)
    gears = np.array(file.transmission.motor_from_joint)
    per_radian = np.array(file.drives.counts_per_revolution) / (2.0 * np.pi)
    unit = 1e-3 * np.array(file.drives.rated_torque_nm)
    counts = np.diag(per_radian) @ gears
    torques = np.ascontiguousarray(gears.T @ np.diag(unit))
    turn = 2.0 * np.pi * file.controller.velocity_cutoff_hz * file.bus.period_s
    return Drives(
        chain_of(nominal),
        cad_parameters(nominal),
        pole**2,
        2.0 * file.controller.damping_ratio * pole,
        -np.expm1(-turn),
        counts,
        np.linalg.inv(counts),
        np.linalg.inv(torques),
        torques,
        file.bus.period_s,
    )


@njit(cache=True)
def encoder_angles(drives, q):
    """Joint angles [rad] as the motors' encoders show them, shape (n,)."""
    return drives.angles @ np.rint(drives.counts @ q)


@njit(cache=True)
def given_torque(drives, tau):
    """Joint torque [N m] that drives give when asked for tau, shape (n,)."""
    return drives.torques @ np.rint(drives.units @ tau)


@njit(cache=True)
def model_torque(drives, q, qd, qdd):
    """Torque of the controller's model [N m], shape (n,)."""
    tau = np.empty_like(q)
    inverse_dynamics(drives.chain, drives.delta, q, qd, qdd, workspace(q.size), tau)
    return tau


@njit(cache=True)
def asked_torque(drives, q, qd, goal):
    """Computed torque (47), (48) towards position, velocity, acceleration: `goal`, shape (3, n)."""
    qdd = goal[2] + drives.kp * (goal[0] - q) + drives.kd * (goal[1] - qd)
    return model_torque(drives, q, qd, qdd)
