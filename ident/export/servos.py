"""An arm with position servos for MuJoCo and Isaac Lab, and its replay in MuJoCo."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import yaml

from ident.dynamics.compiled_chain import chain_of
from ident.export.links import Link, links_of
from ident.export.mjcf import add_joint, each_body, new_mjcf, written
from ident.export.replay import Replay, loaded_mujoco
from ident.export.urdf import comment, numbers
from ident.output_error.plant.servo import motor_command
from ident.output_error.servo_model import ServoModel
from ident.output_error.setup import MotionSegment
from wamctl.arm.robot import cad_parameters

_TIMESTEP_S = 0.002
_UNLIMITED_NM = 1e3
_NO_PLACE = (
    "rate_gain", "integral", "dead_zone", "stribeck", "load_friction", "drag", "skew", "compliance",
    "turning_speed", "presliding", "rise_speed", "gear_lag", "link_armature", "gravity_gain",
)  # fmt: skip
_NO_PROFILE = 1e5  # rad/s^2
_PLAY_DAMPING = 1e-4  # N m s/rad: the gears' grease


def servo_mjcf(model: ServoModel) -> str:
    """A MuJoCo model whose joints are driven by `position` actuators.

    Friction is `damping` and `frictionloss`, the rotor `armature`, a zero `ref`; a constant torque
    is part of the actuator; play is a further joint behind the driven one, free within its range.
    """
    links = links_of(model.robot, model.value("damping"), model.value("coulomb"))
    words = "; ".join([f"{model.arm}, identified by simulation", *not_in_mjcf(model)])
    root = new_mjcf(model.arm, words, model.robot.model.gravity.linear, _TIMESTEP_S)
    for k, body in enumerate(each_body(root, links)):
        _add_joints(body, links[k], model, k)
    actuators = SubElement(root, "actuator")
    offsets = _beside_springs(model)
    for k, link in enumerate(links):
        servo = _servo(actuators, link.joint, float(model.value("stiffness")[k]), offsets[k])
        limit = float(model.value("torque_limit")[k])
        if limit < _UNLIMITED_NM:
            servo.set("forcerange", numbers([-limit, limit]))
    return written(root)


def _servo(actuators: Element, joint: str, stiffness: float, offset: float) -> Element:
    """A position actuator; one that has to overcome a constant torque as a general one."""
    if offset == 0.0:
        return SubElement(actuators, "position", name=joint, joint=joint, kp=repr(stiffness))
    return SubElement(
        actuators,
        "general",
        name=joint,
        joint=joint,
        gainprm=repr(stiffness),
        biastype="affine",
        biasprm=numbers([-offset, -stiffness, 0.0]),
    )


def _beside_springs(model: ServoModel) -> list[float]:
    """Constant torques that no spring of their joint holds [N m]."""
    return [float(x) for x in model.value("offset") * (model.value("spring") == 0.0)]


def not_in_mjcf(model: ServoModel) -> list[str]:
    """What the model holds and MJCF has no place for, one sentence each."""
    said = [f"delay of the commands by joint, to be added: {_listed(model, 'delay', 's')}"]
    if (model.value("profile_acceleration") < _NO_PROFILE).any():
        accelerations = _listed(model, "profile_acceleration", "rad/s^2")
        said.append(f"the servos plan their own motion to a command, at most {accelerations}")
    for name in _NO_PLACE:
        if model.value(name).any():
            said.append(f"no place for {name.replace('_', ' ')}")
    if model.value("half_play").any() and model.at_link.any():
        said.append("the actuators measure before the backlash, the real encoders behind it")
    return [*said, "the URDF's joint limits are not in it"]


def isaaclab_settings(model: ServoModel) -> str:
    """Settings of Isaac Lab's `DelayedPDActuatorCfg` as YAML, joint by joint.

    Written from its documentation: delays count physics steps, friction is in N m.
    """
    names = model.robot.joint_names

    def each(name: str) -> dict[str, float]:
        return {j: float(x) for j, x in zip(names, model.value(name), strict=True)}

    limits = {j: x for j, x in each("torque_limit").items() if x < _UNLIMITED_NM}
    steps = [round(x / _TIMESTEP_S) for x in model.value("delay")]
    settings = {
        "class": "isaaclab.actuators.DelayedPDActuatorCfg",
        "joint_names_expr": list(names),
        "stiffness": each("stiffness"),
        "damping": dict.fromkeys(names, 0.0),
        "armature": each("armature"),
        "friction": each("coulomb"),
        "dynamic_friction": each("coulomb"),
        "viscous_friction": each("damping"),
        "effort_limit": limits,
        "min_delay": min(steps),
        "max_delay": max(steps),
    }
    head = (
        f"# {comment(model.arm)}: servos identified by simulation, for Isaac Lab.\n"
        f"# Physics step: {_TIMESTEP_S} s (delays count its steps). Damping, back EMF and viscous"
        " friction are one number,\n# which stands under viscous_friction.\n"
    )
    said = not_in_mjcf(model)[1:]
    if any(_beside_springs(model)):
        said.append("no place for offset")
    notes = "".join(f"# {sentence[0].upper()}{sentence[1:]}.\n" for sentence in said)
    return head + notes + yaml.safe_dump({"sim_dt": _TIMESTEP_S, "servos": settings},
                                         sort_keys=False)  # fmt: skip


def servo_replay(mjcf: str, model: ServoModel, segments: Sequence[MotionSegment]) -> list[Replay]:
    """Recordings beside MuJoCo and the own simulation under their commands.

    MuJoCo gets the commands as the servos' own planning, feed-forward, and delay make them.

    Raises:
        DataError: MuJoCo is not installed.
    """
    mujoco = loaded_mujoco()
    arm = mujoco.MjModel.from_xml_string(mjcf)
    names = tuple(model.robot.joint_names)
    links = chain_of(model.robot), cad_parameters(model.robot)
    driven = [arm.joint(j).qposadr[0] for j in names]
    loose = [_play_place(arm, j) for j in names]
    found = []
    for segment in segments:
        motion, state = segment.motion, mujoco.MjData(arm)
        state.qpos[driven] = motion.start
        state.qvel[[arm.joint(j).dofadr[0] for j in names]] = motion.speed
        grid, wanted = motor_command(*links, motion, model.settings, _TIMESTEP_S)
        passed = np.empty((len(grid) + 1, len(names)))
        for k in range(len(passed)):
            passed[k] = state.qpos[driven]
            for j, place in enumerate(loose):
                if place is not None and model.at_link[j]:
                    passed[k, j] += state.qpos[place]
            if k < len(grid):
                state.ctrl[:] = wanted[k]
                mujoco.mj_step(arm, state)
        at = motion.t[0] + _TIMESTEP_S * np.arange(len(passed))
        read = np.column_stack([np.interp(motion.t, at, course) for course in passed.T])
        own = model.replay(segment)
        found.append(Replay(segment.name, names, motion.t, segment.q, read, own))
    return found


def _add_joints(body: Element, link: Link, model: ServoModel, k: int) -> None:
    def value(name: str) -> float:
        return float(model.value(name)[k])

    joint = add_joint(
        body,
        link,
        friction=link.coulomb,
        damping=link.viscous,
        armature=value("armature"),
        zero=value("zero"),
        stiffness=value("spring"),
        offset=value("offset"),
    )
    if play := value("half_play"):
        SubElement(
            body,
            "joint",
            name=f"{link.joint} play",
            type=joint.attrib["type"],
            axis=numbers(link.axis),
            damping=repr(_PLAY_DAMPING),
            range=numbers([-play, play]),
        )


def _play_place(arm: object, joint: str) -> int | None:
    try:
        return arm.joint(f"{joint} play").qposadr[0]  # type: ignore[attr-defined]
    except KeyError:
        return None


def _listed(model: ServoModel, name: str, unit: str) -> str:
    return ", ".join(f"{x:.3g}" for x in model.value(name)) + f" {unit}"
