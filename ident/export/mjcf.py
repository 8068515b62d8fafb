"""The identified arm as MJCF: inertials, friction, rotors, springs, offsets, coupled motors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from ident.effects.simulated_model import without_effects
from ident.export.left_out import effects_left_out, exported_arm, sentence
from ident.export.linear_torque import linear_torque
from ident.export.links import Link, held_joints, identified_links
from ident.export.urdf import comment, numbers
from ident.model.identified_model import Model
from ident.signals.arrays import Array

_TIMESTEP_S = 0.0005
_RADIUS_M = 0.03
_HELD = (
    *("chain", "delta", "armature", "viscous", "friction_rows", "coulomb"),
    *("gain", "limit", "encoder_zero"),
)
STIFF_FRICTION = {
    "solreffriction": "0.001 1",
    "solimpfriction": "0.9999 0.9999 0.001 0.5 2",
}
"""By MuJoCo's defaults dry friction creeps: wrist joints of the WAM were off by 0.02 rad."""


@dataclass(frozen=True)
class _Joints:
    """What MuJoCo holds joint by joint, and between joints.

    Attributes:
        armature, damping: of each joint, shape (n,).
        offset, stiffness: torque that the drives must overcome: offset + stiffness q, shape (n,).
        zero: true position less the encoder's [rad], shape (n,).
        gain: torques that act per torques asked for, shape (n, n).
        limit: of the torque asked for [N m], shape (n,).
        tendons: coefficients of joints, shape (n,), with armature, damping and frictionloss.
    """

    armature: Array
    damping: Array
    offset: Array
    stiffness: Array
    zero: Array
    gain: Array
    limit: Array
    tendons: list[tuple[Array, float, float, float]]


def to_mjcf(model: Model) -> str:
    """A MuJoCo model of the arm; a motor drives each joint.

    Joint friction is `damping` and `frictionloss`, a rotor that drives one joint its `armature`. A
    motor that turns with several joints is a fixed tendon over them, with the same three. A spring
    is `stiffness` and `springref`, an offset an actuator that always acts, a joint zero `ref`, a
    torque gain the motor's `gear`; of a differential's motor, a tendon that it pulls.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    exported = exported_arm(model)
    links, joints = identified_links(model, exported.arm), _joints(model)
    words = "; ".join(
        [f"Identified: {model.arm}, {model.estimator} model", *left_out_of_mjcf(model)]
    )
    root = new_mjcf(model.arm, words, exported.arm.chain.gravity, _TIMESTEP_S)
    for k, body in enumerate(each_body(root, links)):
        _add_joint(body, links[k], joints, k)
    _add_tendons(root, model, joints)
    _add_actuators(root, links, joints)
    return written(root)


def left_out_of_mjcf(model: Model) -> list[str]:
    """What the model holds and MJCF has no place for."""
    n = model.robot.dof
    arm, plain = exported_arm(model).arm, without_effects(model)
    held = _HELD if _passive(arm.armature - plain.armature + np.diag(_armature(model))) else ()
    left = effects_left_out(
        model, held or set(_HELD) - {"armature"}, lambda term: linear_torque(term, n) is not None
    )
    return sentence("MJCF", left) + [s for s in (held_joints(model),) if s]


def _joints(model: Model) -> _Joints:
    exported, plain = exported_arm(model), without_effects(model)
    arm, n = exported.arm, model.robot.dof
    linear = [linear_torque(term, n) for term in exported.terms]
    known = [x for x in linear if x is not None]
    tendons = _shared_motors(model)
    extra = arm.coulomb[len(plain.coulomb) :], arm.friction_rows[len(plain.coulomb) :]
    tendons += [(row, 0.0, 0.0, float(level)) for level, row in zip(*extra, strict=True)]
    armature = np.diag(_armature(model)) + arm.armature - plain.armature
    if not _passive(armature):
        armature = np.diag(_armature(model))
    damping = np.diag(arm.viscous) + sum((x.damping for x in known), np.zeros((n, n)))
    own_armature, shared = _split(armature)
    tendons += [(row, size, 0.0, 0.0) for row, size in shared]
    own_damping, shared = _split(damping)
    tendons += [(row, 0.0, size, 0.0) for row, size in shared]
    return _Joints(
        own_armature,
        own_damping,
        model.parameter("fo") + sum((x.offset for x in known), np.zeros(n)),
        sum((x.stiffness for x in known), np.zeros(n)),
        arm.encoder_zero,
        arm.gain,
        arm.limit,
        tendons,
    )


def _split(matrix: Array) -> tuple[Array, list[tuple[Array, float]]]:
    """A symmetric matrix as the joints' own entries, and rows r with sizes s: the sum of s r r^T.

    Joints that share nothing keep their entry on the diagonal.
    """
    coupled = (np.abs(matrix - np.diag(np.diag(matrix))) > 0.0).any(axis=0)
    own = np.where(coupled, 0.0, np.diag(matrix))
    sizes, rows = np.linalg.eigh(matrix - np.diag(own))
    shared = [(row, float(s)) for s, row in zip(sizes, rows.T, strict=True) if s > 1e-12]
    return own, shared


def _passive(matrix: Array) -> bool:
    return bool(np.linalg.eigvalsh(matrix).min() >= -1e-12)


def _shared_motors(model: Model) -> list[tuple[Array, float, float, float]]:
    """The model's own motors that turn with several joints."""
    rows, found = model.terms.drive_matrix, []
    inertia, viscous, coulomb = (model.parameter(kind) for kind in ("ia", "fvm", "fcm"))
    for m in (motor - 1 for motor in model.terms.coupled_motors):
        if inertia[m] or viscous[m] or coulomb[m]:
            found.append((rows[m], float(inertia[m]), float(viscous[m]), float(coulomb[m])))
    return found


def _armature(model: Model) -> Array:
    """Inertia at each joint of the rotors that drive it alone [kg m^2], shape (n,)."""
    inertia = model.parameter("ia")
    matrix = model.terms.drive_matrix
    single = (matrix != 0).sum(axis=1) == 1
    return (inertia[:, None] * matrix**2)[single].sum(axis=0)


def new_mjcf(arm: str, words: str, gravity: Array, step_s: float) -> Element:
    """A model without bodies: gravity [m/s^2], time step [s], and words for a comment."""
    root = Element("mujoco", model=comment(arm))
    root.append(ElementTree.Comment(f" {comment(words)} "))
    SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(
        root,
        "option",
        gravity=numbers(gravity),
        timestep=repr(step_s),
        integrator="implicitfast",
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
    damping: float,
    armature: float,
    zero: float,
    stiffness: float,
    offset: float,
) -> Element:
    """A link's joint: damping [N m s/rad], armature [kg m^2], zero of the encoder [rad].

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
        frictionloss=repr(link.coulomb),
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


def _add_joint(body: Element, link: Link, joints: _Joints, k: int) -> None:
    names = ("damping", "armature", "zero", "stiffness", "offset")
    joint = add_joint(body, link, **{name: float(getattr(joints, name)[k]) for name in names})
    if np.isfinite([link.lower, link.upper]).all() and link.lower < link.upper:
        joint.set("range", numbers([link.lower, link.upper]))


def _add_tendons(root: Element, model: Model, joints: _Joints) -> None:
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


def _moves_others(joints: _Joints, k: int) -> bool:
    return bool(np.count_nonzero(joints.gain[:, k]) > 1)


def _drive(joint: str) -> str:
    return f"{joint} drive"


def _add_actuators(root: Element, links: list[Link], joints: _Joints) -> None:
    """A motor a joint, on a tendon where it moves others too; then offsets without a spring.

    These act without a command.
    """
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
    for k, link in enumerate(links):
        if joints.offset[k] and not joints.stiffness[k]:
            SubElement(
                actuators,
                "general",
                name=f"{link.joint} offset",
                joint=link.joint,
                gainprm="0",
                biastype="affine",
                biasprm=numbers([-joints.offset[k], 0.0, 0.0]),
            )
