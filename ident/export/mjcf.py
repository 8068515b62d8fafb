"""The identified arm as MJCF: inertials, friction, and rotor inertia, coupled motors included."""

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from ident.export.links import Link, held_joints, identified_links
from ident.export.urdf import numbers
from ident.model.identified_model import Model

_RADIUS_M = 0.03


def to_mjcf(model: Model) -> str:
    """A MuJoCo model of the arm; a motor drives each joint.

    Joint friction is `damping` and `frictionloss`, a rotor that drives one joint its `armature`. A
    motor that turns with several joints is a fixed tendon over them, with the same three.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    links = identified_links(model)
    root = ElementTree.Element("mujoco", model=model.arm)
    words = "; ".join([f"{model.arm}, {model.estimator} model", *left_out_of_mjcf(model)])
    root.append(ElementTree.Comment(f" Identified: {words.replace('--', '- -')} "))
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = numbers(model.robot.model.gravity.linear)
    ElementTree.SubElement(
        root, "option", gravity=gravity, timestep="0.0005", integrator="implicitfast"
    )
    parents = [ElementTree.SubElement(root, "worldbody")]
    armature = _armature(model)
    for k, link in enumerate(links):
        above = parents[0 if link.parent is None else link.parent + 1]
        below = [other for other in links if other.parent == k]
        parents.append(_body(above, link, float(armature[k]), below))
    _add_coupled_motors(root, model)
    actuators = ElementTree.SubElement(root, "actuator")
    for link in links:
        motor = ElementTree.SubElement(actuators, "motor", name=link.joint, joint=link.joint)
        if 0 < link.effort < np.inf:
            motor.set("ctrlrange", numbers([-link.effort, link.effort]))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def left_out_of_mjcf(model: Model) -> list[str]:
    """What the model holds and MJCF has no place for."""
    missing = ["torque offset"] if np.any(model.parameter("fo")) else []
    missing += [f"effect {effect.name}" for effect in model.effects.records]
    sentences = [f"left out, since MJCF has no place for it: {', '.join(missing)}"]
    return (sentences if missing else []) + [s for s in (held_joints(model),) if s]


def _body(
    above: ElementTree.Element, link: Link, armature: float, below: list[Link]
) -> ElementTree.Element:
    turn = pin.Quaternion(link.placement[:3, :3].copy())
    body = ElementTree.SubElement(
        above,
        "body",
        name=link.body,
        pos=numbers(link.placement[:3, 3]),
        quat=numbers([turn.w, turn.x, turn.y, turn.z]),
    )
    i = link.inertia
    ElementTree.SubElement(
        body,
        "inertial",
        pos=numbers(link.center),
        mass=repr(link.mass),
        fullinertia=numbers([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )
    joint = ElementTree.SubElement(
        body,
        "joint",
        name=link.joint,
        type="slide" if link.slides else "hinge",
        axis=numbers(link.axis),
        damping=repr(link.viscous),
        frictionloss=repr(link.coulomb),
        armature=repr(armature),
    )
    if np.isfinite([link.lower, link.upper]).all() and link.lower < link.upper:
        joint.set("range", numbers([link.lower, link.upper]))
    for other in below:
        _add_shape(body, other.placement[:3, 3])
    return body


def _add_shape(body: ElementTree.Element, end: np.ndarray) -> None:
    """Something to see: without mass and without contact."""
    shape = {"contype": "0", "conaffinity": "0", "density": "0", "rgba": "0.5 0.6 0.7 1"}
    if np.linalg.norm(end) > _RADIUS_M:
        shape |= {"type": "capsule", "fromto": numbers([0, 0, 0, *end]), "size": str(_RADIUS_M)}
    else:
        shape |= {"type": "sphere", "size": str(1.5 * _RADIUS_M)}
    ElementTree.SubElement(body, "geom", shape)


def _armature(model: Model) -> np.ndarray:
    """Rotor inertia per joint of the motors that drive one joint only, shape (n,)."""
    inertia = model.parameter("ia")
    matrix = model.terms.drive_matrix
    single = (matrix != 0).sum(axis=1) == 1
    return (inertia[:, None] * matrix**2)[single].sum(axis=0)


def _add_coupled_motors(root: ElementTree.Element, model: Model) -> None:
    values = [model.parameter(kind) for kind in ("ia", "fvm", "fcm")]
    tendons = ElementTree.Element("tendon")
    for motor in model.terms.coupled_motors:
        inertia, viscous, coulomb = (float(v[motor - 1]) for v in values)
        if not any((inertia, viscous, coulomb)):
            continue
        tendon = ElementTree.SubElement(
            tendons,
            "fixed",
            name=f"motor{motor}",
            armature=repr(inertia),
            damping=repr(viscous),
            frictionloss=repr(coulomb),
        )
        row = model.terms.drive_matrix[motor - 1]
        for joint, coefficient in zip(model.robot.joint_names, row, strict=True):
            if coefficient:
                ElementTree.SubElement(tendon, "joint", joint=joint, coef=repr(float(coefficient)))
    if len(tendons):
        root.append(tendons)
