"""Effect-free arms of another hand: nothing is missing in them, so nothing may be named.

Run: .venv/bin/python scripts/benchmarks/null_arms.py --out FOLDER [--shape NAME] [--seed S]
     [--runs N] [--motion FILE] [--periods N]

Writes FOLDER/SHAPE-SEED.mcap for each seed: two periods of the shipped motion in closed loop, as
the driver logs it. Links and friction are drawn by the seed; friction is Coulomb's and viscous, and
turns round as the shape says (`null_friction.py`), by joint at random where the shape is `mixed`.
Nothing of `ident` is imported: rigid bodies are Pinocchio's, the rest is written here. The log's
metadata tell the shape of each joint: naming `presliding` where there is a bristle is no error.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from null_friction import DAHL, LUGRE, SHAPES, Friction, step
from numpy.typing import NDArray

from wamctl.arm.config import ArmFile, beside, load_arm_file, shipped_file
from wamctl.arm.recorder import write_recording
from wamctl.arm.recording import Command, Recording
from wamctl.arm.robot import Robot, cad_parameters, load_robot, with_parameters
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Trajectory, read_trajectory, reference, trajectory_yaml

Array = NDArray[np.float64]

CONFIG, MOTION = "wam7.yaml", "wam7-excitation.yaml"
MIXED = "mixed"
INNER_STEPS = 5  # a cycle
NOISE = 2e-3  # of Coulomb friction: torque that no model explains
NOISE_MEMORY_S = 0.05


@dataclass(frozen=True)
class Loop:
    """What the drives and the controller do, for n joints.

    Attributes:
        nominal: the controller's model.
        kp, kd: acceleration per position and velocity error, each of shape (n,).
        forget: share of the old velocity estimate that a cycle keeps.
        counts: motor encoders' counts per joint angle [1/rad], shape (n, n).
        units: steps of motor torque per joint torque [1/(N m)], shape (n, n).
        cycle_s: [s].
    """

    nominal: Robot
    kp: Array
    kd: Array
    forget: float
    counts: Array
    units: Array
    cycle_s: float

    def seen(self, q: Array) -> Array:
        """Joint angles as whole counts tell them [rad], shape (n,)."""
        return np.linalg.solve(self.counts, np.round(self.counts @ q))

    def made(self, tau: Array) -> Array:
        """Joint torque as whole steps of motor torque make it [N m], shape (n,)."""
        return np.linalg.solve(self.units, np.round(self.units @ tau))


def robot_of(file: ArmFile) -> Robot:
    """The nominal robot of the shipped file."""
    urdf = beside(shipped_file(CONFIG), file.robot.urdf)
    facts = file.robot
    return load_robot(
        urdf.read_text(), facts.joints, facts.parameter_frames, facts.gravity_m_s2, urdf
    )


def loop_of(file: ArmFile, nominal: Robot) -> Loop:
    """Drives and controller of the shipped file."""
    gears = np.array(file.transmission.motor_from_joint)
    per_turn = np.array(file.drives.counts_per_revolution)
    bandwidth = np.array(file.controller.bandwidth_rad_s)
    cycle_s = file.bus.period_s
    return Loop(
        nominal,
        bandwidth**2,
        2.0 * file.controller.damping_ratio * bandwidth,
        float(np.exp(-2.0 * np.pi * file.controller.velocity_cutoff_hz * cycle_s)),
        (per_turn / (2.0 * np.pi))[:, None] * gears,
        np.linalg.inv(gears.T) / (1e-3 * np.array(file.drives.rated_torque_nm))[:, None],
        cycle_s,
    )


def shapes_of(shape: str, seed: int, n: int) -> list[str]:
    """The shape of each of n joints."""
    if shape != MIXED:
        return [shape] * n
    return np.random.default_rng([seed, 0xA1]).choice(list(SHAPES), n).tolist()


def drawn(file: ArmFile, nominal: Robot, names: list[str], seed: int) -> tuple[Robot, Friction]:
    """The true arm of a seed: links of other masses, and friction that turns round as named."""
    chance = np.random.default_rng([seed, 0xA2])
    n = nominal.dof
    masses = np.repeat(chance.uniform(0.92, 1.08, n), 10)
    true = with_parameters(nominal, cad_parameters(nominal) * masses)
    kinds, numbers = zip(*(SHAPES[name] for name in names), strict=True)
    bristle = np.isin(kinds, (DAHL, LUGRE))
    widths = np.where(bristle, chance.uniform(1e-4, 6e-4, n), chance.uniform(3e-3, 1.2e-2, n))
    level = np.array(file.simulation.coulomb_nm) * chance.uniform(0.75, 1.35, n)
    viscous = np.array(file.simulation.viscous_nm_s_rad) * chance.uniform(0.75, 1.35, n)
    inertia = np.full(n, 0.01)
    return true, Friction(np.array(kinds), np.array(numbers), widths, level, viscous, inertia)


def coloured_noise(friction: Friction, cycles: int, cycle_s: float, seed: int) -> Array:
    """Torque that no model explains [N m], shape (cycles, n): noise with a memory."""
    chance = np.random.default_rng([seed, 0xA3])
    keep = np.exp(-cycle_s / NOISE_MEMORY_S)
    white = chance.standard_normal((cycles, friction.level.size))
    noise = white.copy()
    for k in range(1, cycles):
        noise[k] = keep * noise[k - 1] + np.sqrt(1.0 - keep**2) * white[k]
    return NOISE * friction.level * noise


def followed(
    loop: Loop, true: Robot, friction: Friction, noise: Array, goals: Array
) -> tuple[Array, Array]:
    """Logged positions [rad] and torques [N m] on the way along goals of shape (cycles, 3, n)."""
    q, v, bristles = goals[0, 0].copy(), np.zeros(true.dof), np.zeros(true.dof)
    readings, asked = np.empty_like(noise), np.empty_like(noise)
    speed, tau = np.zeros(true.dof), np.zeros(true.dof)
    h = loop.cycle_s / INNER_STEPS
    data, model, model_data = true.data(), loop.nominal.model, loop.nominal.data()
    for k, (q_goal, v_goal, a_goal) in enumerate(goals):
        readings[k] = loop.seen(q)
        if k == 0:
            tau = loop.made(pin.rnea(model, model_data, readings[0], speed, speed))
        else:
            difference = (readings[k] - readings[k - 1]) / loop.cycle_s
            speed = loop.forget * speed + (1.0 - loop.forget) * difference
        asked[k] = tau
        for _ in range(INNER_STEPS):
            mass = pin.crba(true.model, data, q)
            mass = np.triu(mass) + np.triu(mass, 1).T
            bias = pin.nonLinearEffects(true.model, data, q, v)
            step(mass, tau - bias - noise[k], friction, v, bristles, h)
            q += h * v
        pull = a_goal + loop.kp * (q_goal - readings[k]) + loop.kd * (v_goal - speed)
        tau = loop.made(pin.rnea(model, model_data, readings[k], speed, pull))
    return readings, asked


def recording(shape: str, seed: int, motion_file: str, periods: int) -> Recording:
    """The log of an effect-free arm.

    Raises:
        ValueError: the arm did not follow.
    """
    file = load_arm_file(shipped_file(CONFIG))
    nominal = robot_of(file)
    loop = loop_of(file, nominal)
    names = shapes_of(shape, seed, nominal.dof)
    true, friction = drawn(file, nominal, names, seed)
    series = read_trajectory(motion_file).series
    motion = reference(series, periods, file.excitation.ramp_s, loop.cycle_s)
    cycles = len(motion.t)
    noise = coloured_noise(friction, cycles, loop.cycle_s, seed)
    goals = np.stack([motion.q, motion.qd, motion.qdd], axis=1)
    q, tau = followed(loop, true, friction, noise, goals)
    if not np.abs(q - motion.q).max() < 0.5:
        raise ValueError(f"{shape}, seed {seed}: the arm did not follow its motion")
    stamp_ns = np.arange(cycles) * round(loop.cycle_s * 1e9)
    return Recording(
        file.robot.joints,
        stamp_ns,
        q,
        None,
        None,
        Command(stamp_ns, motion.q, motion.qd, tau),
        ReferenceSeries(stamp_ns, motion.q, motion.qd, motion.qdd),
        metadata={"shapes": ", ".join(names), "seed": str(seed)},
        attachments={
            "config.yaml": shipped_file(CONFIG).read_bytes(),
            "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
            "trajectory.yaml": trajectory_yaml(Trajectory(series, periods, {}, {})).encode(),
        },
    )


def main() -> None:
    """Write the logs that are asked for."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--out", type=Path, required=True, help="folder for the logs")
    options.add_argument("--shape", action="append", choices=[*SHAPES, MIXED])
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--runs", type=int, default=1, help="seeds, from --seed on")
    options.add_argument("--motion", default=MOTION, help="the trajectory's file")
    options.add_argument("--periods", type=int, default=2)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    for shape in chosen.shape or [*SHAPES, MIXED]:
        for seed in range(chosen.seed, chosen.seed + chosen.runs):
            log = chosen.out / f"{shape}-{seed}.mcap"
            write_recording(log, recording(shape, seed, chosen.motion, chosen.periods))
            print(log, flush=True)


if __name__ == "__main__":
    main()
