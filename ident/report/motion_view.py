"""The arm along its motion, to be looked at in a browser: one file, no network."""

import json
from importlib.resources import files
from itertools import combinations

import numpy as np
import pinocchio as pin

from ident.excitation.design import Design
from ident.signals.arrays import Array
from wamctl.arm.collision import collision_shapes
from wamctl.arm.robot import Robot

_STEP_S = 0.05
_DIGITS = 4


def view_page(design: Design, robot: Robot) -> str:
    """The page as HTML; capsules turn with the arm, boxes are drawn by their edges.

    Args:
        design: the motion, with distances and speeds along it.
        robot: the arm's model, with its collision shapes.
    """
    stride = max(1, round(_STEP_S / (design.t[1] - design.t[0])))
    measured = {quantity.name: quantity.values[::stride] for quantity in design.quantities}
    poses, geometry = measured["position"], collision_shapes(robot).geometry
    places = _placements(robot, geometry, poses)
    thin = [k for k, o in enumerate(geometry.geometryObjects) if hasattr(o.geometry, "halfLength")]
    boxes = [k for k, o in enumerate(geometry.geometryObjects) if hasattr(o.geometry, "halfSide")]
    shapes = geometry.geometryObjects
    nearest = measured["distance"].min(axis=1, initial=np.inf)
    content = {
        "step": float(design.t[stride] - design.t[0]),
        "capsules": [
            {"radius": shapes[k].geometry.radius, "ends": _ends(shapes[k].geometry, places[:, k])}
            for k in thin
        ],
        "boxes": [_edges(shapes[k].geometry, places[0, k]) for k in boxes],
        "tool": _rounded(_tool(robot, poses)),
        "speed": _rounded(measured["speed"][:, -1]),
        "distance": _rounded(np.where(np.isfinite(nearest), nearest, 0.0)),
    }
    page = files("ident.excitation").joinpath("view.html").read_text(encoding="utf-8")
    return page.replace("@MOTION@", json.dumps(content).replace("</", "<\\/"))


def _placements(robot: Robot, geometry: pin.GeometryModel, poses: Array) -> Array:
    """Homogeneous matrix of each shape along the motion, shape (S, B, 4, 4)."""
    data, found = robot.data(), pin.GeometryData(geometry)
    matrices = np.empty((len(poses), geometry.ngeoms, 4, 4))
    for i, pose in enumerate(poses):
        pin.updateGeometryPlacements(robot.model, data, geometry, found, pose)
        for k, place in enumerate(found.oMg):
            matrices[i, k] = place.homogeneous
    return matrices


def _ends(capsule: pin.coal.Capsule, places: Array) -> list[list[list[float]]]:
    """Both ends of a capsule's axis along the motion."""
    half = capsule.halfLength * places[:, :3, 2]
    return _rounded(np.stack([places[:, :3, 3] - half, places[:, :3, 3] + half], axis=1))


def _edges(box: pin.coal.Box, place: Array) -> list[list[list[float]]]:
    """The twelve edges of a box."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = signs * np.asarray(box.halfSide).ravel() @ place[:3, :3].T + place[:3, 3]
    pairs = combinations(range(8), 2)
    return [
        _rounded(corners[[i, j]]) for i, j in pairs if np.count_nonzero(signs[i] != signs[j]) == 1
    ]


def _tool(robot: Robot, poses: Array) -> Array:
    """Path of the last link's origin, shape (S, 3)."""
    data, path = robot.data(), []
    for pose in poses:
        pin.forwardKinematics(robot.model, data, pose)
        path.append(data.oMi[robot.dof].translation.copy())
    return np.array(path)


def _rounded(values: Array) -> list:
    return np.round(values, _DIGITS).tolist()
