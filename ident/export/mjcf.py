"""The identified arm as MJCF: inertials, friction, rotors, springs, offsets, coupled motors."""

from collections.abc import Iterator, Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from ident.export.left_out import exported_arm, sentence
from ident.export.links import Link, held_joints, identified_links
from ident.export.mujoco_joints import MujocoJoints, left_out_of_joints, mujoco_joints
from ident.export.urdf import comment, numbers
from ident.model.identified_model import Model
from ident.signals.arrays import Array

_TIMESTEP_S = 0.0005
_FINER_STEPS = 8  # times, for which the motors' memory of a delay is still long enough
_NO_GAIN = "1e-99"  # 0 would make of a slope that falls the damping ratio of a position servo
_RADIUS_M = 0.03
STIFF_FRICTION = {
    "solreffriction": "0.001 1",
    "solimpfriction": "0.9999 0.9999 0.001 0.5 2",
}
"""By MuJoCo's defaults dry friction creeps: wrist joints of the WAM were off by 0.02 rad."""


def to_mjcf(model: Model) -> str:
    """A MuJoCo model of the arm; a motor drives each joint.

    Joint friction is `damping` and `frictionloss`, a rotor that drives one joint its `armature`. A
    motor that turns with several joints is a fixed tendon over them, with the same three. A spring
    is `stiffness` and `springref`, an offset an actuator that always acts, a joint zero `ref`, a
    torque gain the motor's `gear`; of a differential's motor, a tendon that it pulls. Torque that
    hangs on one joint's speed is `frictionloss` and actuators that damp up to a limit of force; a
    delay the motor's own, which MuJoCo knows from 3.5 on.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    exported, joints = exported_arm(model), mujoco_joints(model)
    links = identified_links(model, exported.arm)
    words = "; ".join(
        [f"Identified: {model.arm}, {model.estimator} model", *left_out_of_mjcf(model)]
    )
    gravity = exported.arm.chain.gravity
    root = new_mjcf(model.arm, words, gravity, _TIMESTEP_S, joints.integrator)
    for k, body in enumerate(each_body(root, links)):
        _add_joint(body, links[k], joints, k)
    _add_tendons(root, model, joints)
    _add_actuators(root, links, joints)
    return written(root)


def left_out_of_mjcf(model: Model) -> list[str]:
    """What the model holds and MJCF has no place for."""
    return sentence("MJCF", left_out_of_joints(model)) + [s for s in (held_joints(model),) if s]


def new_mjcf(
    arm: str, words: str, gravity: Array, step_s: float, integrator: str = "implicitfast"
) -> Element:
    """A model without bodies: gravity [m/s^2], time step [s], and words for a comment."""
    root = Element("mujoco", model=comment(arm))
    root.append(ElementTree.Comment(f" {comment(words)} "))
    SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(
        root,
        "option",
        gravity=numbers(gravity),
        timestep=repr(step_s),
        integrator=integrator,
    )
    return root


def written(root: Element) -> str:
    """The model as text."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def each_body(root: Element, links: Sequence[Link]) -> Iterator[Element]:
    """Add the links' bodies, parents before children; each is given out to get its joints."""
    bodies = [SubElement(root, "worldbody")]
    for link in links:
        body = _add_body(bodies[0 if link.parent is None else link.parent + 1], link)
        yield body
        for other in (o for o in links if o.parent == len(bodies) - 1):
            _add_shape(body, other.placement[:3, 3])
        bodies.append(body)


def add_joint(
    body: Element,
    link: Link,
    *,
    friction: float,
    damping: float,
    armature: float,
    zero: float,
    stiffness: float,
    offset: float,
) -> Element:
    """A link's joint: friction [N m], damping [N m s/rad], armature [kg m^2], encoder's zero [rad].

    The drive must overcome offset + stiffness q [N m]; without stiffness the offset is left out.
    """
    joint = SubElement(
        body,
        "joint",
        STIFF_FRICTION,
        name=link.joint,
        type="slide" if link.slides else "hinge",
        axis=numbers(link.axis),
        damping=repr(damping),
        frictionloss=repr(friction),
        armature=repr(armature),
    )
    if zero:
        joint.set("ref", repr(-zero))
    if stiffness > 0.0:
        joint.set("stiffness", repr(stiffness))
        joint.set("springref", repr(-offset / stiffness - zero))
    return joint


def _add_body(above: Element, link: Link) -> Element:
    """A link's body below its parent's, without its joint."""
    turn = pin.Quaternion(link.placement[:3, :3].copy())
    body = SubElement(
        above,
        "body",
        name=link.body,
        pos=numbers(link.placement[:3, 3]),
        quat=numbers([turn.w, turn.x, turn.y, turn.z]),
    )
    i = link.inertia
    SubElement(
        body,
        "inertial",
        pos=numbers(link.center),
        mass=repr(link.mass),
        fullinertia=numbers([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )
    return body


def _add_shape(body: Element, end: Array) -> None:
    """Something to see: without mass and without contact."""
    shape = {"contype": "0", "conaffinity": "0", "density": "0", "rgba": "0.5 0.6 0.7 1"}
    if np.linalg.norm(end) > _RADIUS_M:
        shape |= {"type": "capsule", "fromto": numbers([0, 0, 0, *end]), "size": str(_RADIUS_M)}
    else:
        shape |= {"type": "sphere", "size": str(1.5 * _RADIUS_M)}
    SubElement(body, "geom", shape)


def _add_joint(body: Element, link: Link, joints: MujocoJoints, k: int) -> None:
    names = ("friction", "damping", "armature", "zero", "stiffness", "offset")
    joint = add_joint(body, link, **{name: float(getattr(joints, name)[k]) for name in names})
    if np.isfinite([link.lower, link.upper]).all() and link.lower < link.upper:
        joint.set("range", numbers([link.lower, link.upper]))


def _add_tendons(root: Element, model: Model, joints: MujocoJoints) -> None:
    tendons = Element("tendon")
    for number, (row, inertia, viscous, coulomb) in enumerate(joints.tendons, 1):
        tendon = SubElement(
            tendons,
            "fixed",
            STIFF_FRICTION,
            name=f"motor{number}",
            armature=repr(inertia),
            damping=repr(viscous),
            frictionloss=repr(coulomb),
        )
        _add_joints(tendon, model.robot.joint_names, row)
    for k, joint in enumerate(model.robot.joint_names):
        if _moves_others(joints, k):
            tendon = SubElement(tendons, "fixed", name=_drive(joint))
            _add_joints(tendon, model.robot.joint_names, joints.gain[:, k])
    if len(tendons):
        root.append(tendons)


def _add_joints(tendon: Element, names: Sequence[str], row: Array) -> None:
    for joint, coefficient in zip(names, row, strict=True):
        if coefficient:
            SubElement(tendon, "joint", joint=joint, coef=repr(float(coefficient)))


def _moves_others(joints: MujocoJoints, k: int) -> bool:
    return bool(np.count_nonzero(joints.gain[:, k]) > 1)


def _drive(joint: str) -> str:
    return f"{joint} drive"


def _add_actuators(root: Element, links: list[Link], joints: MujocoJoints) -> None:
    """A motor a joint, on a tendon where it moves others too; then what acts without a command."""
    actuators = SubElement(root, "actuator")
    for k, link in enumerate(links):
        motor = SubElement(actuators, "motor", name=link.joint)
        if _moves_others(joints, k):
            motor.set("tendon", _drive(link.joint))
        else:
            motor.set("joint", link.joint)
            if joints.gain[k, k] != 1.0:
                motor.set("gear", repr(float(joints.gain[k, k])))
        most = min(link.effort if link.effort > 0 else np.inf, float(joints.limit[k]))
        if most < np.inf:
            motor.set("ctrlrange", numbers([-most, most]))
        if delay := float(joints.delay[k]):
            motor.set("delay", repr(delay))
            motor.set("nsample", str(_FINER_STEPS * int(np.ceil(delay / _TIMESTEP_S)) + 1))
    for k, link in enumerate(links):
        if joints.offset[k] and not joints.stiffness[k]:
            _add_bias(actuators, link, "offset", float(joints.offset[k]), 0.0)
        for number, damper in enumerate(joints.dampers[k], 1):
            added = _add_bias(actuators, link, f"damper {number}", damper.bias, damper.slope)
            added.set("forcerange", numbers([-damper.upper, -damper.lower]))


def _add_bias(actuators: Element, link: Link, what: str, bias: float, slope: float) -> Element:
    """An actuator without a command; the drive must overcome bias + slope qd [N m]."""
    return SubElement(
        actuators,
        "general",
        name=f"{link.joint} {what}",
        joint=link.joint,
        gainprm=_NO_GAIN,
        biastype="affine",
        biasprm=numbers([-bias, 0.0, -slope]),
    )
