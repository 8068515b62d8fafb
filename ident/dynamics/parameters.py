"""The parameters of the dynamic model: their names, units, and order, as in (8) of the paper."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.signals.arrays import Array
from wamctl.arm.inertial import INERTIAL_NAMES, parameter_name
from wamctl.arm.robot import Robot

Kind = Literal["inertial", "fv", "fc", "fo", "ia", "fvm", "fcm"]

KIND_OF_TERM: dict[str, Kind] = {
    "viscous": "fv",
    "coulomb": "fc",
    "offset": "fo",
    "rotor_inertia": "ia",
}
"""What holds each term of an arm's settings, at a joint and its motor."""

NON_NEGATIVE: tuple[Kind, ...] = ("fv", "fc", "ia", "fvm", "fcm")
"""Kinds that (17) keeps from being negative; the offset `fo` has no sign."""


@dataclass(frozen=True)
class Parameter:
    """One entry of delta.

    Attributes:
        name: as Table I prints it (`L2xx`, `l3y`, `m4`, `fv1`); `fvm6` belongs to motor 6.
        unit: SI unit.
        kind: which column of the regressor it multiplies.
        index: link, joint, or motor, from 1.
    """

    name: str
    unit: str
    kind: Kind
    index: int


@dataclass(frozen=True)
class Terms:
    """What the model holds beside the links.

    Attributes:
        viscous, coulomb: joint friction (3).
        offset: a constant torque per joint.
        rotor_inertia: the rotors' inertia, one per motor.
        drive_matrix: motor speed from joint speed, shape (n, n); each row is scaled so that its
            largest entry is 1, so that a rotor's inertia and a motor's friction are given at the
            joint that it drives most.
        motor_friction: whether friction acts on the coupled motors too.
    """

    viscous: bool
    coulomb: bool
    offset: bool
    rotor_inertia: bool
    drive_matrix: Array
    motor_friction: bool

    @property
    def coupled_motors(self) -> tuple[int, ...]:
        """Motors, from 1, that turn with more than one joint."""
        return tuple(1 + int(m) for m in np.flatnonzero((self.drive_matrix != 0).sum(axis=1) > 1))


def unit_rows(motor_from_joint: Array) -> Array:
    """The matrix with the largest entry of each row, by size, scaled to 1."""
    largest = np.abs(motor_from_joint).argmax(axis=1)
    return motor_from_joint / motor_from_joint[np.arange(len(largest)), largest][:, None]


def standard_parameters(robot: Robot, terms: Terms) -> tuple[Parameter, ...]:
    """All entries of delta, link by link: the ten inertial ones, then friction, as in (8).

    Offset, rotor inertia, and the friction of coupled motors follow the paper's two friction
    parameters.
    """
    return tuple(
        p for k in range(1, robot.dof + 1) for p in _of_link(k, terms, is_revolute(robot, k))
    )


def is_revolute(robot: Robot, joint: int) -> bool:
    """Whether a joint, from 1, turns; Pinocchio calls sliding ones JointModelPX and the like."""
    return not str(robot.model.joints[joint].shortname()).startswith("JointModelP")


def of_joint(unit: str, slides: bool) -> str:
    """A unit of a number at one joint: where it slides a force instead of a torque, m for rad."""
    if not slides:
        return unit
    linear = unit.replace("kg m^2", "kg").replace("N m", "N").replace("rad", "m")
    return linear.replace("(N)", "N")


def _of_link(k: int, terms: Terms, revolute: bool) -> list[Parameter]:
    units = ["kg m^2"] * 6 + ["kg m"] * 3 + ["kg"]
    link = [
        Parameter(parameter_name(s, k), unit, "inertial", k)
        for s, unit in zip(INERTIAL_NAMES, units, strict=True)
    ]
    on_motor = terms.motor_friction and k in terms.coupled_motors
    choices: list[tuple[bool, Kind, str]] = [
        (terms.viscous, "fv", "N m s/rad"),
        (terms.coulomb, "fc", "N m"),
        (terms.offset, "fo", "N m"),
        (terms.rotor_inertia, "ia", "kg m^2"),
        (on_motor and terms.viscous, "fvm", "N m s/rad"),
        (on_motor and terms.coulomb, "fcm", "N m"),
    ]
    return link + [
        Parameter(f"{kind}{k}", of_joint(unit, not revolute), kind, k)
        for wanted, kind, unit in choices
        if wanted
    ]
