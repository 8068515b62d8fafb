"""Recordings of the product's own simulated arm without its bus: a tenth of the lockstep's time.

The physics, hidden effects and motors are those of `sim_bus`; encoders, drives' steps of torque and
the computed-torque controller are the benchmark's own (`gap_drives.py`), one torque a cycle as on
the wire.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from gap_drives import asked_torque, drives_of, encoder_angles, model_torque
from numpy.typing import NDArray

from ident.model.arm import arm_from_file
from sim_bus.assembly import Simulation, load_simulation
from wamctl.arm.config import ArmFile, load_arm_file, shipped_file
from wamctl.arm.recording import Command, Recording
from wamctl.arm.robot import Robot
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Reference, Trajectory, read_trajectory, reference, trajectory_yaml

Array = NDArray[np.floating]

MOTION = "wam7-excitation.yaml"
OTHER_MOTION = "wam7-excitation-balanced.yaml"

COULOMB = yaml.safe_load(shipped_file("wam7.yaml").read_text())["simulation"]["coulomb_nm"]
"""Usual dry friction of each joint [N m]."""


@dataclass(frozen=True)
class Cell:
    """A simulated arm's file, with what its drives know.

    Attributes:
        path: of the arm's file.
        file, robot: its content.
        seed: which arm.
        hidden: file of the effects that it carries, or None.
    """

    path: Path
    file: ArmFile
    robot: Robot
    seed: int
    hidden: Path | None = None

    def simulation(self, start: Array) -> Simulation:
        """The arm, at rest in a pose, shape (n,)."""
        content = yaml.safe_load(self.path.read_text())
        content["simulation"]["start_pose_rad"] = [float(q) for q in start]
        placed = self.path.with_suffix(".placed.yaml")
        placed.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_simulation(placed, self.seed, self.hidden)


def cell(folder: Path, seed: int, spread: float, hidden: Path | None = None) -> Cell:
    """A WAM whose friction is drawn anew, in a file of its own.

    Args:
        folder: for the file.
        seed: which arm.
        spread: of the logarithm of each friction value.
        hidden: file of the effects that it carries, or None.
    """
    shipped, path = shipped_file("wam7.yaml"), folder / f"arm{seed}.yaml"
    content = yaml.safe_load(shipped.read_text())
    rng = np.random.default_rng(seed)
    for name in ("viscous_nm_s_rad", "coulomb_nm"):
        size = content["simulation"][name]
        content["simulation"][name] = [
            x * float(np.exp(rng.uniform(-spread, spread))) for x in size
        ]
    for section, key in (("robot", "urdf"), ("drives", "dictionary"), ("excitation", "trajectory")):
        content[section][key] = str(shipped.parent / content[section][key])
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return Cell(path, load_arm_file(path), arm_from_file(path, ()).robot, seed, hidden)


def recorded(cell: Cell, motion_file: str, periods: int) -> Recording:
    """The log of a motion, with what `wamctl excite` attaches to it."""
    excitation = read_trajectory(motion_file)
    file = cell.file
    motion = reference(excitation.series, periods, file.excitation.ramp_s, file.bus.period_s)
    log = follow(cell, motion)
    series = ReferenceSeries(log.stamp_ns, motion.q, motion.qd, motion.qdd)
    inside = {
        "config.yaml": shipped_file("wam7.yaml").read_bytes(),
        "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
        "trajectory.yaml": trajectory_yaml(Trajectory(excitation.series, periods, {}, {})).encode(),
    }
    return replace(log, reference=series, attachments=inside)


def follow(cell: Cell, motion: Reference) -> Recording:
    """Positions that the encoders read, and torque that acts from then on, a row a cycle."""
    file = cell.file
    drives = drives_of(file, cell.robot)
    plant = cell.simulation(motion.q[0]).arm.plant
    plant.release()
    unit = 1e-3 * np.array(file.drives.rated_torque_nm)
    step_ns = round(file.bus.period_s * 1e9)
    readings, given = np.empty_like(motion.q), np.empty_like(motion.q)
    speed = no_braking = np.zeros(cell.robot.dof)
    tau = model_torque(drives, motion.q[0], speed, speed)
    for k, goal in enumerate(np.stack([motion.q, motion.qd, motion.qdd], axis=1)):
        seen = encoder_angles(drives, plant.seen_at(plant.time_ns))
        if k:
            speed = speed + drives.blend * ((seen - readings[k - 1]) / drives.cycle_s - speed)
        permille = np.rint(drives.units @ tau)
        readings[k], given[k] = seen, drives.torques @ permille
        tau = asked_torque(drives, seen, speed, goal)
        plant.advance((k + 1) * step_ns, unit * permille, no_braking)
    if not np.isfinite(readings).all() or np.abs(readings - motion.q).max() > 1.5:
        raise ValueError("the arm did not follow its reference")
    stamp = np.arange(len(readings), dtype=np.int64) * step_ns
    command = Command(stamp, motion.q, motion.qd, given)
    return Recording(file.robot.joints, stamp, readings, None, None, command)
