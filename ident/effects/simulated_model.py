"""The identified arm with its effects, ready for the closed loop."""

from dataclasses import replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.effects.bound_effects import members_of
from ident.effects.catalogue import catalogue
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.simulation.arm import SETTINGS, SimulatedArm, Term, constant_torque, simulated_arm, term
from wamctl.arm.errors import DataError
from wamctl.arm.robot import cad_parameters, with_parameters


@term
def _motor_drag(t, q, qd, load, joint, settings, resistance, level):
    speed = 0.0
    for k in range(qd.size):
        speed += settings[1 + k] * qd[k]
    resistance[joint] += settings[0] * speed


def simulation_of(model: Model) -> SimulatedArm:
    """The arm of a `model.yaml`, ready for the closed loop.

    Raises:
        DataError: an effect that the catalogue does not know, or an arm with too many joints.
    """
    return _with_effects(without_effects(model), model)


def _with_effects(arm: SimulatedArm, model: Model) -> SimulatedArm:
    for candidate, values in members_of(model):
        arm = catalogue()[candidate.effect].simulated(arm, candidate, values)
    return arm


def _links(model: Model) -> SimulatedArm:
    """Links and joint friction."""
    friction = model.parameter("fv"), model.parameter("fc")
    return simulated_arm(chain_of(model.robot), model.inertial, *friction)


def with_loads(arm: Arm, model: Model) -> Arm:
    """An arm whose links bear what a model's effects add to them, such as a mass at the tool.

    Where links have no mass in the URDF, the arm stays as it is: it tells no weights.
    """
    known = cad_parameters(arm.robot)
    more = _with_effects(_links(model), model).delta - model.inertial
    if not more.any() or (known[9::10] == 0.0).any():
        return arm
    return replace(arm, robot=with_parameters(arm.robot, known + more))


def without_effects(model: Model) -> SimulatedArm:
    """The same without the named effects: links, friction, rotors and offsets.

    Raises:
        DataError: an arm with too many joints.
    """
    friction, n = model.terms.drive_matrix, model.robot.dof
    arm = replace(_links(model), armature=friction.T @ np.diag(model.parameter("ia")) @ friction)
    terms = [
        Term(constant_torque, j, (float(c),)) for j, c in enumerate(model.parameter("fo")) if c
    ]
    for m in np.flatnonzero(model.parameter("fcm")):
        arm = replace(
            arm,
            friction_rows=np.vstack([arm.friction_rows, friction[m]]),
            coulomb=np.append(arm.coulomb, model.parameter("fcm")[m]),
            bristle=np.append(arm.bristle, 0.0),
        )
    dragging = np.flatnonzero(model.parameter("fvm"))
    if len(dragging) and n >= SETTINGS:
        raise DataError(f"Drag on shared motors is simulated for at most {SETTINGS - 1} joints.")
    for m in dragging:
        drag = model.parameter("fvm")[m]
        for j in np.flatnonzero(friction[m]):
            settings = (float(drag * friction[m, j]), *(float(x) for x in friction[m]))
            terms.append(Term(_motor_drag, int(j), settings[: n + 1]))
    return replace(arm, terms=tuple(terms))
