"""From the arm's file to the simulated arm."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim_bus.can_bus.frame_length import BitTiming
from sim_bus.canopen.devices import canopen_devices
from sim_bus.hidden_effects.catalogue import hidden, read_hidden_file
from sim_bus.node import Devices, SyncSchedule
from sim_bus.plant.physics import Physics, plain_physics
from sim_bus.plant.plant import EndStops, Plant
from sim_bus.plant.truth import Truth, draw_truth
from sim_bus.puck.devices import classic_devices
from sim_bus.simulated_arm import SimulatedArm
from wamctl.arm.config import (
    ArmFile,
    PuckDrivesSection,
    SimulationSection,
    beside,
    find_file,
    load_arm_file,
)
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot, load_robot

_STOP_CLEARANCE_RAD = 0.1  # the mechanical stops lie this far beyond the position limits
_STOP_GIVE_RAD = 0.02  # the largest joint torque presses this far into a stop
_STOP_SETTLING_S = 0.01  # damping of a stop over its stiffness


@dataclass(frozen=True)
class Simulation:
    """A simulated arm, ready to be served.

    Attributes:
        arm: drives and physics.
        node_ids: of its drives, as configured, in the order of the motors.
        truth: what the arm really is, but for hidden effects.
        is_fd: whether its drives speak CAN FD.
        timing: bit rates of its bus.
        period_ns: cycle time.
        schedule: the frames of a cycle.
    """

    arm: SimulatedArm
    node_ids: tuple[int, ...]
    truth: Truth
    is_fd: bool
    timing: BitTiming
    period_ns: int
    schedule: SyncSchedule


def load_simulation(
    config: str | Path,
    seed: int,
    effects: Path | None = None,
    misnumbered: Mapping[int, int] | None = None,
) -> Simulation:
    """The simulated arm of a configuration file.

    Args:
        config: the file, or the name of a shipped one.
        seed: which arm.
        effects: file of hidden effects that the arm carries.
        misnumbered: node ids that drives have in the place of the configured ones.

    Raises:
        ConfigurationError: a file that cannot be used, or that has no `simulation` section.
    """
    path = find_file(config)
    file = load_arm_file(path)
    if file.simulation is None:
        raise ConfigurationError(path, ["simulation: missing, so there is no arm to simulate"])
    robot = _robot(file, path)
    truth = draw_truth(robot, file.transmission, file.simulation, seed)
    physics = plain_physics(truth, np.array(file.robot.gravity_m_s2))
    if effects is not None:
        physics = hidden(physics, read_hidden_file(effects), seed, effects)
    plant = _plant(file, file.simulation, robot, physics)
    if effects is not None and plant.least_inertia <= 0.0:
        problem = "motors beside their links have more inertia than the joints: less motor_kg_m2"
        raise ConfigurationError(effects, [problem])
    devices = _devices(file, path, plant, truth, misnumbered or {})
    arm = SimulatedArm(
        plant,
        devices.encoders,
        devices.motors,
        devices.others,
        np.array(file.simulation.braking_nm_s_rad),
    )
    period_ns = round(file.bus.period_s * 1e9)
    data_bit_s = file.bus.data_bitrate_bit_s or file.bus.bitrate_bit_s
    timing = BitTiming(file.bus.bitrate_bit_s, data_bit_s)
    return Simulation(
        arm, file.drives.node_ids, truth, file.bus.is_fd, timing, period_ns, devices.schedule
    )


def _robot(file: ArmFile, path: Path) -> Robot:
    urdf = beside(path, file.robot.urdf)
    try:
        text = urdf.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(path, [f"robot.urdf: cannot be read ({error})"]) from error
    return load_robot(
        text, file.robot.joints, file.robot.parameter_frames, file.robot.gravity_m_s2, urdf
    )


def _devices(
    file: ArmFile, path: Path, plant: Plant, truth: Truth, misnumbered: Mapping[int, int]
) -> Devices:
    node_ids = tuple(misnumbered.get(node, node) for node in file.drives.node_ids)
    drives = file.drives.model_copy(update={"node_ids": node_ids})
    if isinstance(drives, PuckDrivesSection):
        return classic_devices(drives, path, plant, truth)
    return canopen_devices(drives, path, plant, truth, file.bus.is_fd)


def _plant(file: ArmFile, simulation: SimulationSection, robot: Robot, physics: Physics) -> Plant:
    ceiling = np.abs(physics.truth.motor_from_joint).T @ np.array(file.limits.motor_torque_nm)
    stiffness = ceiling / _STOP_GIVE_RAD
    stops = EndStops(
        np.array(file.limits.position_lower_rad) - _STOP_CLEARANCE_RAD,
        np.array(file.limits.position_upper_rad) + _STOP_CLEARANCE_RAD,
        stiffness,
        stiffness * _STOP_SETTLING_S,
    )
    start = np.array(simulation.start_pose_rad)
    return Plant(robot, physics, stops, start, round(simulation.step_s * 1e9))
