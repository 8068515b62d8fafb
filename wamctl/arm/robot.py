"""The rigid-body model of the arm: loaded once, here, for all three packages."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from wamctl.arm.arrays import Array
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.inertial import INERTIAL_NAMES, PINOCCHIO_INDEX, change_of_frame, parameter_name
from wamctl.arm.urdf.mimic import in_the_way, named, pairs_of
from wamctl.arm.urdf.numbers import number_faults

_BLOCK = 256  # samples whose regressor stays in the processor's cache

_REPAIR = (
    "Correct the URDF, or let `ident check-urdf FILE.urdf --out repaired.urdf` repair what it can."
)


@dataclass(frozen=True)
class Robot:
    """A chain of n one-degree-of-freedom joints on a fixed base.

    Attributes:
        model: Pinocchio's model, whose joints are exactly `joint_names`, in that order. Treat it as
            read-only.
        joint_names: names of the n joints, from the base outwards.
        parameter_placements: per joint the homogeneous matrix, shape (4, 4), of the frame in which
            the link's parameters are expressed, seen from the joint's frame.
        urdf: text of the URDF, so that a log can carry it.
        parameter_frames: names of those frames; empty where the joint frames themselves serve.
    """

    model: pin.Model
    joint_names: tuple[str, ...]
    parameter_placements: tuple[Array, ...]
    urdf: str
    parameter_frames: tuple[str, ...] = ()

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.joint_names)

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which joints are prismatic, shape (n,)."""
        return np.any(self.motion_subspaces[:, :3] != 0.0, axis=1)

    @property
    def motion_subspaces(self) -> Array:
        """Each joint's velocity (linear, angular) in its own frame, shape (n, 6)."""
        data, q, spaces = self.data(), pin.neutral(self.model), np.zeros((self.dof, 6))
        for k in range(self.dof):
            jacobian = pin.computeJointJacobian(self.model, data, q, k + 1)
            spaces[k] = jacobian.reshape(6, self.dof)[:, k]
        return spaces

    @property
    def inertial_names(self) -> tuple[str, ...]:
        """Names of the 10 n inertial parameters in the order of (8), link by link."""
        return tuple(parameter_name(s, k) for k in range(1, self.dof + 1) for s in INERTIAL_NAMES)

    def data(self) -> pin.Data:
        """A fresh workspace for Pinocchio's algorithms (one for each thread)."""
        return self.model.createData()


def load_robot(
    urdf: str,
    joint_names: tuple[str, ...] = (),
    parameter_frames: tuple[str, ...] = (),
    gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, -9.81),
    source: Path | str = "URDF",
) -> Robot:
    """The robot of a URDF text; joints that are not named are locked at zero.

    So are joints that mimic another, and those that they mimic: a gripper's fingers.

    Args:
        urdf: text of the URDF.
        joint_names: the joints to keep, from the base outwards; empty keeps every joint that moves
            by itself.
        parameter_frames: per kept joint the URDF link in whose frame the parameters of (8) are
            expressed; empty: the joint's own frame.
        gravity_m_s2: gravity in the base frame [m/s^2].
        source: what to call the URDF in messages.

    Raises:
        ConfigurationError: unreadable URDF, unknown joint or frame, joints with more than one
            degree of freedom, or a linkage of joints that mimic each other.
    """
    full = _parse(urdf, source)
    known = [n for n in full.names if n != "universe"]
    missing = [n for n in joint_names if n not in known]
    if missing:
        raise ConfigurationError(
            source, [f"no joint named {n!r}; its joints are {', '.join(known)}" for n in missing]
        )
    pairs = pairs_of(urdf)
    faults = named(pairs, joint_names) if joint_names else in_the_way(pairs, full)
    if faults:
        raise ConfigurationError(source, faults)
    kept = joint_names or [n for n in known if n not in pairs and n not in pairs.values()]
    locked = [full.getJointId(n) for n in known if n not in kept]
    model = _locked(full, locked) if locked else full
    names = tuple(n for n in model.names if n != "universe")
    odd = [n for i, n in enumerate(names, 1) if model.joints[i].nq != 1 or model.joints[i].nv != 1]
    if odd:
        raise ConfigurationError(
            source,
            [f"joint {n!r} has more than one degree of freedom: leave it out" for n in odd],
        )
    if joint_names and names != tuple(joint_names):
        raise ConfigurationError(
            source, [f"the joints along the chain are {', '.join(names)}: list them in this order"]
        )
    model.gravity.linear = np.asarray(gravity_m_s2, dtype=float)
    return Robot(
        model,
        names,
        _placements(model, names, parameter_frames, source),
        urdf,
        tuple(parameter_frames),
    )


def _locked(full: pin.Model, joints: list[int]) -> pin.Model:
    """The robot with these joints fixed.

    Pinocchio finds frames by name alone while it fixes a joint, so that these joints, and those
    that a URDF fixes, get another where they have that of a link.
    """
    links = {f.name for f in full.frames if f.type == pin.FrameType.BODY}
    named = {full.names[i]: i for i in joints if full.names[i] in links}
    for frame in full.frames:
        if frame.type == pin.FrameType.FIXED_JOINT and frame.name in links:
            frame.name = f"{frame.name} (joint)"
        elif frame.type == pin.FrameType.JOINT and frame.name in named:
            full.names[named[frame.name]] = frame.name = f"{frame.name} (joint)"
    return pin.buildReducedModel(full, joints, pin.neutral(full))


def _parse(urdf: str, source: Path | str) -> pin.Model:
    refuse_xacro(urdf, source)
    try:
        faults = number_faults(urdf)
    except ElementTree.ParseError as error:
        raise ConfigurationError(source, [f"not a readable URDF ({error})"]) from error
    if faults:
        raise ConfigurationError(source, faults, _REPAIR)
    try:
        return pin.buildModelFromXML(_with_turn_limits(urdf))
    except (ValueError, RuntimeError) as error:
        text = f"not a readable URDF ({str(error).splitlines()[0].rstrip('.')})"
        raise ConfigurationError(source, [text], _REPAIR) from error


def refuse_xacro(urdf: str, source: Path | str) -> None:
    """See that a text is a URDF, and not what one is made of.

    Raises:
        ConfigurationError: macros or expressions wait to be expanded.
    """
    if _is_xacro(urdf):
        raise ConfigurationError(
            source, ["xacro, not URDF: make one of it with `xacro FILE > arm.urdf`, and give that"]
        )


def _is_xacro(text: str) -> bool:
    """Whether macros or expressions wait to be expanded, outside of comments."""
    if "<xacro:" not in text and "${" not in text:
        return False
    try:
        elements = list(ElementTree.fromstring(text).iter())
    except ElementTree.ParseError:
        return False
    values = [value for e in elements for value in e.attrib.values()]
    return any("xacro}" in e.tag for e in elements) or any("${" in value for value in values)


def _with_turn_limits(urdf: str) -> str:
    """The text with each continuous joint as a revolute one that may be anywhere on its circle.

    Pinocchio would describe such a joint by sine and cosine.
    """
    if "continuous" not in urdf:
        return urdf
    try:
        root = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from error
    for joint in root.iterfind("joint[@type='continuous']"):
        joint.set("type", "revolute")
        limit = joint.find("limit")
        if limit is None:
            none = str(np.finfo(float).max)
            limit = ElementTree.SubElement(joint, "limit", effort=none, velocity=none)
        limit.set("lower", str(-np.pi))
        limit.set("upper", str(np.pi))
    return ElementTree.tostring(root, encoding="unicode")


def _placements(
    model: pin.Model, names: tuple[str, ...], frames: tuple[str, ...], source: Path | str
) -> tuple[Array, ...]:
    if not frames:
        return tuple(np.eye(4) for _ in names)
    if len(frames) != len(names):
        raise ConfigurationError(
            source, [f"{len(frames)} parameter frames for {len(names)} joints"]
        )
    placements, faults = [], []
    for joint, name in enumerate(frames, 1):
        if not model.existFrame(name):
            faults.append(f"no frame named {name!r}")
            continue
        frame = model.frames[model.getFrameId(name)]
        if frame.parentJoint != joint:
            faults.append(f"frame {name!r} is not fixed to the link of joint {names[joint - 1]!r}")
        placements.append(np.asarray(frame.placement.homogeneous))
    if faults:
        raise ConfigurationError(source, faults)
    return tuple(placements)


def cad_parameters(robot: Robot) -> Array:
    """Inertial parameters of the URDF, shape (10 n,), in the order and frames of the robot."""
    links = []
    for k, placement in enumerate(robot.parameter_placements, 1):
        in_joint_frame = robot.model.inertias[k].toDynamicParameters()[list(PINOCCHIO_INDEX)]
        links.append(change_of_frame(np.linalg.inv(placement)) @ in_joint_frame)
    return np.concatenate(links)


def with_parameters(robot: Robot, delta: Array) -> Robot:
    """The same robot with other inertial parameters.

    Args:
        robot: kinematics, frames and gravity.
        delta: inertial parameters, shape (10 n,), in the order of (8) and in the parameter frames.
            Pinocchio keeps mass, centre of mass and tensor, so a zero mass is refused.

    Raises:
        ValueError: a mass of zero, for which no centre of mass exists.
    """
    model = pin.Model(robot.model)
    for k, placement in enumerate(robot.parameter_placements, 1):
        link = change_of_frame(placement) @ delta[10 * (k - 1) : 10 * k]
        if link[9] == 0.0:
            raise ValueError(f"link {k} has no mass")
        vector = np.zeros(10)
        vector[list(PINOCCHIO_INDEX)] = link
        model.inertias[k] = pin.Inertia.FromDynamicParameters(vector)
    return Robot(
        model, robot.joint_names, robot.parameter_placements, robot.urdf, robot.parameter_frames
    )


def regressor(
    robot: Robot, q: Array, qd: Array, qdd: Array, columns: Sequence[int] | None = None
) -> Array:
    """Rigid-body regressor H of (6) for S samples, shape (S, n, c) [N m per parameter].

    Args:
        robot: kinematics, frames and gravity.
        q: joint position [rad], shape (S, n).
        qd: joint velocity [rad/s], shape (S, n).
        qdd: joint acceleration [rad/s^2], shape (S, n).
        columns: the c wanted columns, as places in `Robot.inertial_names`; None: all 10 n.
    """
    samples, n = q.shape
    wanted = np.arange(10 * n) if columns is None else np.asarray(columns, dtype=int)
    links = _columns_by_link(robot, wanted)
    data = robot.data()
    result = np.empty((samples, n, len(wanted)))
    block = np.empty((min(_BLOCK, samples), n, 10 * n))
    for start in range(0, samples, _BLOCK):
        stop = min(start + _BLOCK, samples)
        for i in range(start, stop):
            block[i - start] = pin.computeJointTorqueRegressor(
                robot.model, data, q[i], qd[i], qdd[i]
            )
        for k, (places, to_joint) in enumerate(links):
            link = block[: stop - start, :, 10 * k : 10 * k + 10]
            result[start:stop, :, places] = link @ to_joint
    return result


def _columns_by_link(robot: Robot, wanted: NDArray[np.int_]) -> list[tuple[NDArray, Array]]:
    """Per link the places of its wanted columns, and the matrix that makes them of Pinocchio's."""
    links = []
    for k, placement in enumerate(robot.parameter_placements):
        to_joint = np.zeros((10, 10))
        to_joint[list(PINOCCHIO_INDEX)] = change_of_frame(placement)
        places = np.flatnonzero(wanted // 10 == k)
        links.append((places, to_joint[:, wanted[places] % 10]))
    return links


def inverse_dynamics(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Torque of (1) [N m], shape (S, n), by the recursive Newton-Euler algorithm."""
    data = robot.data()
    return np.array(
        [pin.rnea(robot.model, data, *sample).copy() for sample in zip(q, qd, qdd, strict=True)]
    )
