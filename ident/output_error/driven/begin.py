"""Where a fit of an arm that torque drives begins: with what regression found."""

from collections.abc import Sequence

import numpy as np

from ident.dynamics.base_parameters import BaseMap
from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.parameters import Terms
from ident.output_error.driven.columns import LEAST, DrivenArm
from ident.output_error.driven.tracking import followed, tracking
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.prepared import resolution_of
from ident.output_error.servo_model import STEP_S
from ident.output_error.setup import Setup
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.robot import Robot

_MOTOR_FRICTION = ("fvm", "fcm")


def begun(
    robot: Robot, terms: Terms, base: BaseMap, delta: Array, data: Sequence[Dataset]
) -> tuple[DrivenArm, Array, Array]:
    """Arm and recordings, and base parameters and settings to begin with.

    Args:
        robot: kinematics and frames.
        terms: what the model holds beside the links.
        base: its base parameters.
        delta: standard parameters near which it is, those of links possible ones, shape (p,).
        data: the recordings.

    Raises:
        DataError: friction of motors that drive two joints, or recordings too short to simulate.
    """
    if any(p.kind in _MOTOR_FRICTION for p in base.parameters):
        raise DataError(
            "Friction of motors that drive two joints each is not simulated; use the regression, or"
            " friction of the joints (identification: motor_friction in the arm's file)."
        )
    chain, links = chain_of(robot), delta[[p.kind == "inertial" for p in base.parameters]]
    bare = Setup(chain, links, np.zeros(robot.dof, dtype=bool), (), STEP_S)
    one = np.ones(robot.dof)
    arm = DrivenArm(robot, terms, base, bare, delta, one, one, one)
    settings = arm.settings_with(base.K @ delta, _nothing(robot.dof))
    keeps = tracking(chain, links, settings[ROW["armature"]], data)
    segments = followed(data, keeps)
    if not segments:
        raise DataError("No recording holds two seconds of unbroken motion to be simulated.")
    settings[ROW["stiffness"]], settings[ROW["speed_gain"]] = keeps.stiffness, keeps.damping
    setup = Setup(chain, links, bare.at_link, segments, STEP_S, resolution_of(segments))
    torque = np.concatenate([s.tau for d in data for s in d.segments]).std(axis=0)
    torque = np.maximum(torque, LEAST)
    arm = DrivenArm(robot, terms, base, setup, delta, keeps.stiffness, torque, keeps.inertia)
    return arm, base.K @ delta, settings


def _nothing(dof: int) -> Array:
    """Settings of joints without friction, rotors, or delay, shape (quantities, n)."""
    made = np.array([[q.first] * dof for q in QUANTITIES])
    made[ROW["delay"]] = 0.0
    for name in ("armature", "damping", "coulomb"):
        made[ROW[name]] = QUANTITIES[ROW[name]].low
    return made
