"""True parameters of the simulated arm: CAD inertias, disturbed but physical, and friction."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from wamctl.arm.arrays import Array
from wamctl.arm.config import SimulationSection, TransmissionSection
from wamctl.arm.inertial import from_pseudo_inertia, pseudo_inertia
from wamctl.arm.robot import Robot, cad_parameters


@dataclass(frozen=True)
class Truth:
    """The parameters of the simulated arm, n joints.

    Attributes:
        names: names of the inertial parameters, 10 n, in the order of (8) of the paper.
        delta: inertial parameters in the robot's parameter frames, shape (10 n,).
        viscous: joint side [N m s/rad], shape (n,).
        coulomb: joint side [N m], shape (n,).
        rotor_inertia: motor side [kg m^2], shape (n,); zeros when the rotors do not act.
        motor_from_joint: motor angle per joint angle, shape (n, n).
        seed: of the disturbance.
    """

    names: tuple[str, ...]
    delta: Array
    viscous: Array
    coulomb: Array
    rotor_inertia: Array
    motor_from_joint: Array
    seed: int


def draw_truth(
    robot: Robot, transmission: TransmissionSection, simulation: SimulationSection, seed: int
) -> Truth:
    """The truth for a seed; the same seed gives the same arm."""
    random = np.random.default_rng(seed)
    links = cad_parameters(robot).reshape(robot.dof, 10)
    spread = simulation.inertia_spread
    delta = np.concatenate([disturbed(links[k], spread, random) for k in range(robot.dof)])
    rotors = np.array(transmission.rotor_inertia_kg_m2)
    return Truth(
        robot.inertial_names,
        delta,
        np.array(simulation.viscous_nm_s_rad),
        np.array(simulation.coulomb_nm),
        rotors if simulation.with_rotor_inertia else np.zeros_like(rotors),
        np.array(transmission.motor_from_joint),
        seed,
    )


def disturbed(link: Array, spread: float, random: np.random.Generator) -> Array:
    """Another link that a distribution of positive mass can have, about `spread` (relative) away.

    Its pseudo-inertia is C (E + S)(E + S)^T C^T, with P = C C^T that of the given link and normal
    numbers of deviation `spread / 2` in S: a congruence, so that it stays positive definite, and
    the mass, which is twice as sensitive, deviates by about `spread`.

    Args:
        link: inertial parameters, shape (10,), with a positive definite pseudo-inertia.
        spread: relative spread.
        random: source of chance.
    """
    change = np.eye(4) + 0.5 * spread * random.standard_normal((4, 4))
    half = np.asarray(np.linalg.cholesky(pseudo_inertia(link)), dtype=np.float64) @ change
    return np.asarray(from_pseudo_inertia(half @ half.T), dtype=np.float64)


def write_truth(path: Path, truth: Truth) -> None:
    """The truth as YAML, for tests that compare an identified model with it."""
    content = {
        "seed": truth.seed,
        "inertial": {n: float(v) for n, v in zip(truth.names, truth.delta, strict=True)},
        "viscous_nm_s_rad": truth.viscous.tolist(),
        "coulomb_nm": truth.coulomb.tolist(),
        "rotor_inertia_kg_m2": truth.rotor_inertia.tolist(),
        "motor_from_joint": truth.motor_from_joint.tolist(),
    }
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
