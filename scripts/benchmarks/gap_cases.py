"""What the blind benchmark of `ident gap` hides: perturbed arms, recorded with and without it.

Seeds below 1000 are for development; the others are for scoring.
"""

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from gap_effects import Usual, make, try_pair
from gap_plants import DAHL, LUGRE, SLIP, Body, Hidden, Noise, record
from numpy.typing import NDArray

from ident.model.arm import arm_from_file
from wamctl.arm.config import ArmFile, load_arm_file, shipped_file
from wamctl.arm.recording import Recording
from wamctl.arm.robot import Robot, cad_parameters
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import (
    Reference,
    Trajectory,
    read_trajectory,
    reference,
    trajectory_yaml,
)

Array = NDArray[np.floating]

PERIODS = 2
MOTION = "wam7-excitation.yaml"
KINDS = 8  # ways of turning round, as gap_plants numbers them
PAIRS = ((1, 2), (4, 5))

# usual size: in units of the joint's Coulomb friction, of its largest torque, or in SI
KNOWN = {
    "torque_offset": (0.5, "coulomb"),
    "unequal_friction": (0.3, "si"),
    "joint_spring": (0.6, "coulomb"),
    "stribeck": (0.7, "coulomb"),
    "nonlinear_viscous": (0.5, "coulomb"),
    "asymmetric_viscous": (0.4, "coulomb"),
    "load_dependent_friction": (0.12, "si"),
    "coupled_friction": (0.5, "coulomb"),
    "thermal_drift": (0.5, "coulomb"),
    "gravity_tilt": (0.03, "si"),
    "encoder_offset": (0.04, "si"),
    "torque_gain": (0.06, "si"),
    "torque_delay": (0.006, "si"),
    "torque_ripple": (0.25, "coulomb"),
    "rotor_inertia": (0.02, "coulomb"),
    "contact": (6.0, "si"),
}
RARE = {
    "torque_saturation": (0.25, "peak"),  # below the largest torque
    "joint_elasticity": (0.02, "si"),  # wind-up under it [rad]
    "backlash": (0.005, "si"),
    "coupled_inertia": (0.02, "coulomb"),
    "payload": (1.0, "si"),
}
CHANGES = (
    *("payload", "gravity_tilt", "encoder_offset", "torque_gain", "torque_offset"),
    *("joint_spring", "stribeck", "contact"),
)
"""What may have become of an arm since its model was made."""

STRANGE = {
    "one_sided_stop": (3.0, "coulomb"),
    "position_dependent_friction": (0.5, "coulomb"),
    "other_period": (0.25, "coulomb"),
    "cross_talk": (0.5, "coulomb"),
    "periodic_in_time": (0.25, "coulomb"),
    "hard_cubic_spring": (0.6, "coulomb"),
}
_NAMES = {"unequal_friction": "torque_offset"}  # exact equivalents have one name
_WHOLE = ("gravity_tilt", "torque_delay", "contact", "payload")  # felt on more joints than one


@dataclass(frozen=True)
class Case:
    """One hidden effect.

    Attributes:
        family: its name.
        joints: from 0.
        size: in the family's unit.
    """

    family: str
    joints: tuple[int, ...]
    size: float

    @property
    def answer(self) -> str:
        """What the tool ought to say."""
        return "unknown" if self.family in STRANGE else _NAMES.get(self.family, self.family)

    @property
    def felt(self) -> tuple[int, ...]:
        """The joints whose torque shows it, from 0."""
        everywhere = (*_WHOLE, "encoder_offset", "torque_ripple", "other_period", "cross_talk")
        return tuple(range(7)) if self.family in everywhere else self.joints

    def at(self, joints: set[int]) -> bool:
        """Whether these are its joints."""
        return self.family in _WHOLE or bool(joints & set(self.joints))


@dataclass(frozen=True)
class Run:
    """A recorded arm.

    Attributes:
        cases: what is hidden; nothing, one, or two.
        hidden: how, for each of them.
        log, free: with the effects, and the same arm without them.
        alone: with each effect by itself.
        bristles: joints (from 0) that give way before they slide.
    """

    cases: tuple[Case, ...]
    hidden: tuple[Hidden, ...]
    log: Recording
    free: Recording
    alone: tuple[Recording, ...]
    bristles: frozenset[int]


def draw(
    rng: np.random.Generator, units: dict[str, Array], scale: float, families: list[str]
) -> Case:
    """One effect at one place.

    Args:
        rng: chooses.
        units: of size, for each joint [SI], each of shape (7,).
        scale: of the usual size.
        families: to choose from.
    """
    family = str(rng.choice(families))
    joint = int(rng.integers(0, 7))
    joints = PAIRS[int(rng.integers(0, 2))] if family.startswith("coupled") else (joint,)
    if family == "encoder_offset":
        joints = (int(rng.integers(1, 4)),)
    if family == "rotor_inertia":
        joints = (int(rng.integers(2, 7)),)  # on joints 1 and 2 the links' inertia absorbs it
    size, unit = (KNOWN | RARE | STRANGE)[family]
    size *= scale * float(np.exp(rng.uniform(-2.5, 0.3))) * float(units[unit][joints[0]])
    return Case(family, joints, size)


@dataclass(frozen=True)
class Plant:
    """A perturbed arm that can be recorded.

    Attributes:
        file, robot: what the tool knows of it.
        body: what it is.
        bristles: joints (from 0) that give way before they slide.
        seed: of its noise.
    """

    file: ArmFile
    robot: Robot
    body: Body
    bristles: frozenset[int]
    seed: int

    def recorded(self, hidden: Hidden, excitation: Trajectory) -> Recording:
        """The log of a motion.

        Raises:
            ValueError: the arm did not follow.
        """
        motion = self.motion(excitation)
        inside = {
            "config.yaml": shipped_file("wam7.yaml").read_bytes(),
            "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
            "trajectory.yaml": trajectory_yaml(excitation).encode(),
        }
        noise = Noise(2e-3 * self.body.coulomb, 0.05)
        log = record(self.file, self.robot, self.body, hidden, noise, motion, self.seed)
        series = ReferenceSeries(log.stamp_ns, motion.q, motion.qd, motion.qdd)
        return replace(log, reference=series, attachments=inside)

    def motion(self, excitation: Trajectory) -> Reference:
        """What it is asked to follow."""
        ramp_s, period_s = self.file.excitation.ramp_s, self.file.bus.period_s
        return reference(excitation.series, excitation.periods, ramp_s, period_s)

    @property
    def coulomb(self) -> Array:
        """Usual dry friction [N m], shape (7,)."""
        return np.array(self.file.simulation.coulomb_nm)


def plant(rng: np.random.Generator, seed: int) -> Plant:
    """Links, friction and reversals drawn about those of the shipped arm."""
    file = load_arm_file("wam7.yaml")
    robot = arm_from_file(Path("wam7.yaml"), ()).robot
    usual, drag = (
        np.array(x) for x in (file.simulation.coulomb_nm, file.simulation.viscous_nm_s_rad)
    )
    return Plant(file, robot, *_body(rng, usual, drag, robot), seed)


def first_motion(name: str = MOTION) -> Trajectory:
    """Two periods of a shipped motion."""
    return Trajectory(read_trajectory(name).series, PERIODS, {}, {})


def run(seed: int, count: int, scale: float, families: list[str], motion_file: str = MOTION) -> Run:
    """Two periods of a perturbed arm with some effects, all different, and without.

    Raises:
        ValueError: the arm did not follow.
    """
    rng = np.random.default_rng(seed)
    arm, excitation = plant(rng, seed), first_motion(motion_file)
    free = arm.recorded(Hidden(), excitation)
    units, seen = usual_of(arm, free, excitation)
    cases: list[Case] = []
    for _ in range(count):
        others = [f for f in families if f not in {c.family for c in cases}]
        cases.append(draw(rng, units, scale, others))
    matrix = np.array(arm.file.transmission.motor_from_joint)
    parts = [make(c.family, c.joints, c.size, rng, matrix, seen) for c in cases]
    log = arm.recorded(functools.reduce(try_pair, parts), excitation) if parts else free
    alone = tuple(arm.recorded(p, excitation) for p in parts) if count > 1 else (log,) * count
    return Run(tuple(cases), tuple(parts), log, free, alone, arm.bristles)


def usual_of(arm: Plant, free: Recording, excitation: Trajectory) -> tuple[dict[str, Array], Usual]:
    """Units of size, for each joint [SI], and what is usual on a motion."""
    peak, motion = np.abs(_command(free)).max(axis=0), arm.motion(excitation)
    units = {"coulomb": arm.coulomb, "peak": peak, "si": np.ones(len(peak))}
    return units, Usual(motion.q.min(axis=0), motion.q.max(axis=0), peak)


def _command(log: Recording) -> Array:
    if log.command is None or log.command.effort is None:
        raise ValueError("the recording has no commanded torque")
    return log.command.effort


def _body(
    rng: np.random.Generator, coulomb: Array, viscous: Array, robot: Robot
) -> tuple[Body, frozenset[int]]:
    """A perturbed arm, and which of its joints have bristles."""
    level = coulomb * np.exp(rng.uniform(-0.3, 0.3, 7))
    links = cad_parameters(robot).reshape(-1, 10) * (1 + rng.uniform(-0.08, 0.08, (7, 1)))
    kinds = rng.integers(0, KINDS, 7)
    distance = np.isin(kinds, (DAHL, LUGRE, SLIP))
    widths = np.where(distance, rng.uniform(1e-4, 6e-4, 7), rng.uniform(3e-3, 1.2e-2, 7))
    drag = viscous * np.exp(rng.uniform(-0.3, 0.3, 7))
    body = Body(links.ravel(), drag, level, kinds, widths)
    return body, frozenset(int(j) for j in np.flatnonzero(distance))


def truth_of(case: Case, hidden: Hidden) -> dict[str, float]:
    """Sizes that the answer ought to give, by the name of the parameter; signs left out."""
    if case.family == "coupled_friction":
        return {f"coulomb_{m}": float(f) for m, f in enumerate(hidden.shared_level, 1)}
    name = {
        "torque_offset": "offset",
        "joint_spring": "stiffness",
        "stribeck": "extra_friction",
        "asymmetric_viscous": "half_difference",
        "encoder_offset": "offset",
        "torque_delay": "delay",
        "rotor_inertia": "inertia",
        "payload": "mass",
        "backlash": "half_play",
    }.get(case.family)
    return {name: case.size} if name else {}
