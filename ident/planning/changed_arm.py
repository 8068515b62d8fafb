"""A model of an arm to which something known has been done."""

from dataclasses import replace

import numpy as np

from ident.model.identified_model import Model
from wamctl.arm.configuration.known_change import KnownChange
from wamctl.arm.robot import Robot, load_robot


def changed(model: Model, change: KnownChange) -> Model:
    """The model with a mass at its tool or on another base; its effects act on all of it.

    A gain's error, for example, scales the torque of the mass, too: that is what tells it from
    another mass of the links. The model's base parameters are those before, and left out.

    Args:
        model: of the arm before.
        change: what has been done.
    """
    if not change.alters_the_model:
        return model
    delta = model.delta.copy()
    mass, *point = change.load
    c = np.array(point)
    tensor = mass * (c @ c * np.eye(3) - np.outer(c, c))[np.triu_indices(3)]
    last = np.flatnonzero([p.kind == "inertial" for p in model.parameters])[-10:]
    delta[last] += np.concatenate([tensor, mass * c, [mass]])
    return replace(model, delta=delta, robot=_tilted(model, change), base_parameters=())


def _tilted(model: Model, change: KnownChange) -> Robot:
    robot = model.robot
    x, y = change.tilt_rad
    if x == y == 0.0:
        return robot
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    gx, gy, gz = (about_x @ about_y).T @ robot.model.gravity.linear
    names, frames = robot.joint_names, robot.parameter_frames
    return load_robot(robot.urdf, names, frames, (float(gx), float(gy), float(gz)))
