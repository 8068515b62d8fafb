"""All that can be refused before a bus is opened, in one go."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pinocchio as pin

from wamctl.arm.config import (
    ArmFile,
    CanopenDrivesSection,
    beside,
    find_file,
    load_arm_file,
    read_text,
)
from wamctl.arm.control import computed_torque
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.joint_labels import numbered_joints
from wamctl.arm.robot import Robot, load_robot
from wamctl.arm.trajectory import Reference, Trajectory, read_trajectory, reference
from wamctl.arm.trajectory_check import check_trajectory
from wamctl.arm.transmission import Transmission, transmission
from wamctl.canopen.dictionary import load_dictionary
from wamctl.drives import bus_load
from wamctl.experiment.loop import Arm
from wamctl.experiment.protocols import bus_plan

T = TypeVar("T")

_SYNCS_BEFORE_LOSS = 3
_POSES = 200  # at random, in which the weight of the links is looked at
LONGEST_PERIOD_S = 320.0
"""Every millisecond of a period is checked against all limits; this many take half a minute."""
LONGEST_MOTION_S = 7200.0
"""An operator stays beside the moving arm for as long."""
MOST_OF_EFFORT = 2.0
"""By so much may makers' figures for the same joint differ; a wrong digit is a factor of ten."""
MOST_LAG_RAD = 1.0
"""Leaves a critically damped loop 17 degrees of its phase margin of 76."""


@dataclass(frozen=True)
class Prepared:
    """A configuration that passed every check that needs no bus.

    Attributes:
        path: the arm's file.
        arm: its content, the models and the controller.
        trajectory: what to excite the arm with.
        excitation: its samples, ramps included.
        load: share of the bus.
    """

    path: Path
    arm: Arm
    trajectory: Trajectory
    excitation: Reference
    load: bus_load.Load


def load_arm(config: str | Path) -> tuple[Path, Arm]:
    """The arm of a configuration file.

    Raises:
        ConfigurationError: all faults of the file and of the files it names.
    """
    path = find_file(config)
    file = load_arm_file(path)
    faults: list[str] = []
    robot = _collected(faults, lambda: _robot(file, path))
    joints = _collected(faults, lambda: transmission(file.transmission, str(path)))
    if isinstance(file.drives, CanopenDrivesSection):
        eds, node = beside(path, file.drives.dictionary), file.drives.node_ids[0]
        _collected(faults, lambda: load_dictionary(eds, node))
        faults += _drive_faults(file, file.drives)
    if robot is not None:
        faults += _frame_faults(file, robot) + _weight_faults(robot)
    if robot is not None and joints is not None:
        faults += _effort_faults(file, robot, joints) + _bandwidth_faults(file, robot, joints)
        faults += _release_faults(file, robot)
    if faults or robot is None or joints is None:
        raise ConfigurationError(path, faults)
    return path, Arm(file, robot, joints, computed_torque(robot, file.controller))


def prepare(config: str | Path, trajectory: str | Path | None = None) -> Prepared:
    """Configuration and trajectory, checked against each other and against the bus.

    Args:
        config: the arm's file, or the name of a shipped one.
        trajectory: its file; unset: the one that the configuration names.

    Raises:
        ConfigurationError: all faults at once.
    """
    path, arm = load_arm(config)
    file = arm.file
    load = bus_plan(file)
    faults = bus_load.faults(load)
    found = _collected(faults, lambda: _trajectory(file, path, trajectory))
    if found is not None and (slow := _length_faults(found)):
        raise ConfigurationError(path, faults + slow)
    if found is not None:
        faults += check_trajectory(file, arm.robot, found)
    if faults or found is None:
        raise ConfigurationError(path, faults)
    motion = reference(found.series, found.periods, file.excitation.ramp_s, file.bus.period_s)
    return Prepared(path, arm, found, motion, load)


def _collected(faults: list[str], build: Callable[[], T]) -> T | None:
    try:
        return build()
    except ConfigurationError as error:
        faults += [f"{error.path.name}: {fault}" for fault in error.faults]
        return None


def _robot(file: ArmFile, path: Path) -> Robot:
    source, section = beside(path, file.robot.urdf), file.robot
    frames, gravity = section.parameter_frames, section.gravity_m_s2
    return load_robot(read_text(source), section.joints, frames, gravity, source.name)


def _trajectory(file: ArmFile, path: Path, given: str | Path | None) -> Trajectory:
    if given is not None:
        return read_trajectory(given)
    if file.excitation.trajectory is None:
        raise ConfigurationError(
            path, ["excitation.trajectory: unset, and no --trajectory was given"]
        )
    return read_trajectory(beside(path, file.excitation.trajectory))


def _length_faults(trajectory: Trajectory) -> list[str]:
    """Motions that would take hours, or whose checks would."""
    period_s = 2.0 * math.pi / trajectory.series.fundamental_rad_s
    total_s = period_s * trajectory.periods
    faults = []
    if not period_s <= LONGEST_PERIOD_S:
        faults.append(
            f"the trajectory's period is {period_s:.4g} s, above the limit of "
            f"{LONGEST_PERIOD_S:g} s"
        )
    if not total_s <= LONGEST_MOTION_S:
        faults.append(
            f"the trajectory's counted periods take {total_s:.4g} s, above the limit of "
            f"{LONGEST_MOTION_S:g} s"
        )
    return faults


def _drive_faults(file: ArmFile, drives: CanopenDrivesSection) -> list[str]:
    faults = []
    if len(set(drives.node_ids)) != len(drives.node_ids):
        faults.append("drives.node_ids: two drives share a node")
    least_ms = _SYNCS_BEFORE_LOSS * file.bus.period_s * 1e3
    if drives.sync_loss_ms < least_ms:
        faults.append(
            f"drives.sync_loss_ms: {drives.sync_loss_ms} ms is less than {_SYNCS_BEFORE_LOSS} "
            f"cycles ({least_ms:g} ms), so that one late SYNC would stop the arm"
        )
    return faults


def _weight_faults(robot: Robot) -> list[str]:
    """Links that the gravity model does not carry."""
    return [
        f"robot.urdf: the link behind {name} has no mass, so that its weight would not be carried"
        for k, name in enumerate(numbered_joints(robot.joint_names), 1)
        if not robot.model.inertias[k].mass > 0.0
    ]


def _effort_faults(file: ArmFile, robot: Robot, joints: Transmission) -> list[str]:
    """Ratios and torque limits that together contradict what the URDF lets a joint bear."""
    most = np.abs(joints.motor_from_joint).T @ np.array(file.limits.motor_torque_nm)
    efforts, names = robot.model.effortLimit.tolist(), numbered_joints(robot.joint_names)
    return [
        f"transmission.motor_from_joint and limits.motor_torque_nm: the motors could give {name} "
        f"{torque:.4g} N m, above {MOST_OF_EFFORT:g} times the {effort:.4g} N m that the URDF lets "
        "it bear"
        for name, torque, effort in zip(names, most.tolist(), efforts, strict=True)
        if effort > 0.0 and torque > MOST_OF_EFFORT * effort
    ]


def _bandwidth_faults(file: ArmFile, robot: Robot, joints: Transmission) -> list[str]:
    """Joints whose loop would oscillate.

    The velocity loop crosses over at 2 zeta w times the share of the inertia that the control law
    knows of; the velocity's filter, half a period of its difference, one of the bus and half of one
    for which torque is held turn the phase back there.
    """
    control, rotors = file.controller, np.array(file.transmission.rotor_inertia_kg_m2)
    middle = np.add(file.limits.position_lower_rad, file.limits.position_upper_rad) / 2.0
    links = np.diag(pin.crba(robot.model, robot.data(), middle))
    unknown = (joints.motor_from_joint**2).T @ rotors
    lag_s = 1.0 / (2.0 * math.pi * control.velocity_cutoff_hz) + 2.0 * file.bus.period_s
    crossover = 2.0 * control.damping_ratio * np.array(control.bandwidth_rad_s)
    lag = crossover * links / (links + unknown) * lag_s
    names = numbered_joints(robot.joint_names)
    return [
        f"controller.bandwidth_rad_s: {control.bandwidth_rad_s[k]:g} rad/s of {names[k]} is too "
        f"fast for a loop that lags by {lag_s * 1e3:.1f} ms: its velocity would lag by "
        f"{lag[k]:.2g} rad (limit {MOST_LAG_RAD:g} rad)"
        for k in np.flatnonzero(lag > MOST_LAG_RAD).tolist()
    ]


def _release_faults(file: ArmFile, robot: Robot) -> list[str]:
    """Joints that fall when the arm is released, since damping M 2 zeta w hardly holds weight g."""
    control, limits, data = file.controller, file.limits, robot.data()
    poses = np.random.default_rng(0).uniform(
        limits.position_lower_rad, limits.position_upper_rad, (_POSES, robot.dof)
    )
    inertias = np.array([np.diag(pin.crba(robot.model, data, q)).copy() for q in poses])
    weights = np.array([pin.computeGeneralizedGravity(robot.model, data, q).copy() for q in poses])
    damping = inertias * 2.0 * control.damping_ratio * np.array(control.bandwidth_rad_s)
    falls = np.divide(np.abs(weights), damping, out=np.zeros_like(damping), where=damping > 0.0)
    speeds = falls.max(axis=0)
    most = np.array(limits.velocity_rad_s) * file.safety.velocity_margin
    names = numbered_joints(robot.joint_names)
    return [
        f"controller.bandwidth_rad_s: {control.bandwidth_rad_s[k]:g} rad/s of {names[k]} would let "
        f"it sink at up to {speeds[k]:.2g} rad/s when it is released (limit {most[k]:g} rad/s)"
        for k in np.flatnonzero(speeds > most).tolist()
    ]


def _frame_faults(file: ArmFile, robot: Robot) -> list[str]:
    return [
        f"limits.{field}: the URDF has no link {frame!r}"
        for field, frame in (
            ("elbow_frame", file.limits.elbow_frame),
            ("tool_frame", file.limits.tool_frame),
        )
        if not robot.model.existFrame(frame)
    ]
