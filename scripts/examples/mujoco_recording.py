"""A ROS 2 bag of any arm, as a stranger would bring it: simulated by MuJoCo, not by our own code.

Usage: python scripts/examples/mujoco_recording.py ARM.urdf BAG [--seed N] [--seconds S] [--sqlite]

The arm in MuJoCo is not quite the URDF's: its masses are off, and its joints have friction and
rotors (MuJoCo's `damping`, `frictionloss`, `armature`). A joint-wise PD controller with gravity
compensation moves it along sums of sines; grippers and mimic joints are held. The bag carries
/joint_states alone: position and velocity as an encoder would give them, effort as a noisy torque
sensor would. `--seed` chooses the motion, `--arm-seed` the arm. Needs MuJoCo
(`pip install .[test]`).
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

Array = NDArray[np.floating]

_STEP_S = 0.001
_RECORDED_EVERY = 2
_BASE_RAD_S = 2 * np.pi / 20
_HARMONICS = 5
_ENCODER_RAD = 2 * np.pi / 2**18
_REACH, _SPEED = 0.6, 0.4
"""Parts of a joint's range and of its speed limit that the motion uses."""
_BANDWIDTH_RAD_S = 25.0
_SHARE = {"frictionloss": 0.03, "damping": 0.03, "armature": 0.002, "noise": 0.003}
"""Of the effort limit: friction, drag at full speed, rotor [kg m^2 per N m], sensor's noise."""
_USUAL = {"velocity": "2.0", "effort": "50.0"}
_RANGES = {
    "revolute": _USUAL,
    "prismatic": _USUAL,
    "continuous": _USUAL | {"lower": str(-np.pi), "upper": str(np.pi)},
}
"""Limits by type of joint, where the URDF has none."""
_HARD = (2 * _STEP_S, 1.0)
"""MuJoCo's friction gives way over this time [s]; its own 20 ms would make light joints creep."""


@dataclass(frozen=True)
class Joint:
    """A joint with a motor: its range, and how fast and strong it is.

    Attributes:
        name: in the URDF.
        lower, upper: range [rad or m].
        velocity: limit [rad/s or m/s].
        effort: limit [N m or N].
    """

    name: str
    lower: float
    upper: float
    velocity: float
    effort: float


@dataclass(frozen=True)
class Recorded:
    """What the bag will carry: S samples of n joints, shapes (S,) and (S, n)."""

    names: tuple[str, ...]
    stamp_ns: NDArray[np.int64]
    q: Array
    qd: Array
    effort: Array


def driven_joints(root: ElementTree.Element) -> list[Joint]:
    """The moving joints of a URDF; those that mimic another, and these others, are a gripper's."""
    followers = root.findall("joint[mimic]")
    leaders = {j.find("mimic").attrib["joint"] for j in followers}
    found = []
    for joint in root.iterfind("joint"):
        kind, name = joint.get("type"), joint.attrib["name"]
        if kind not in _RANGES or joint in followers or name in leaders:
            continue
        limit = joint.find("limit")
        given = _RANGES[kind] | (limit.attrib if limit is not None else {})
        numbers = (float(given[n]) for n in ("lower", "upper", "velocity", "effort"))
        found.append(Joint(name, *numbers))
    return found


def arm_of(root: ElementTree.Element, joints: list[Joint], rng: np.random.Generator):
    """MuJoCo's model: bodies a little other than the URDF's, joints with friction and rotors."""
    for link in root.iterfind("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    model.opt.timestep = _STEP_S
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    factor = rng.uniform(0.8, 1.2, model.nbody)
    model.body_mass[:] *= factor
    model.body_inertia[:] *= factor[:, None]
    model.dof_solref[:] = _HARD
    for joint in joints:
        at = model.joint(joint.name).dofadr[0]
        model.dof_frictionloss[at] = _SHARE["frictionloss"] * joint.effort * rng.uniform(0.5, 1.5)
        full = _SHARE["damping"] * joint.effort / joint.velocity
        model.dof_damping[at] = full * rng.uniform(0.5, 1.5)
        model.dof_armature[at] = _SHARE["armature"] * joint.effort * rng.uniform(0.5, 1.5)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def inertias(model, data) -> Array:
    """Diagonal of the mass matrix, shape (nv,)."""
    column, diagonal = np.zeros(model.nv), np.zeros(model.nv)
    for k, unit in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, column, unit)
        diagonal[k] = column[k]
    return diagonal


@dataclass(frozen=True)
class Motion:
    """Sums of sines about the middle of each joint's range; each starts and ends at rest."""

    middle: Array
    amplitude: Array
    phase: Array
    seconds: float

    def at(self, t: float) -> Array:
        """Where the joints should be at a time [s], shape (n,)."""
        rise = np.clip(min(t, self.seconds - t) / 3.0, 0.0, 1.0)
        turn = _BASE_RAD_S * np.arange(1, _HARMONICS + 1) * t
        swing = (self.amplitude * np.sin(turn + self.phase)).sum(axis=1)
        return self.middle + rise**2 * (3 - 2 * rise) * swing


def motion_of(joints: list[Joint], seconds: float, rng: np.random.Generator) -> Motion:
    """A motion within the parts of range and speed that are allowed."""
    shape = (len(joints), _HARMONICS)
    amplitude, phase = rng.uniform(0.2, 1.0, shape), rng.uniform(0, 2 * np.pi, shape)
    turn = _BASE_RAD_S * np.arange(1, _HARMONICS + 1)
    t = np.linspace(0, 20, 2001)
    waves = np.sin(np.multiply.outer(t, turn)[:, None, :] + phase)
    places = np.abs((amplitude * waves).sum(axis=2)).max(axis=0)
    slopes = np.cos(np.multiply.outer(t, turn)[:, None, :] + phase) * turn
    speeds = np.abs((amplitude * slopes).sum(axis=2)).max(axis=0)
    # No further than half a turn, whatever a wrist's range.
    half = np.array([min((j.upper - j.lower) / 2, np.pi / 2) for j in joints])
    fast = np.array([j.velocity for j in joints])
    size = np.minimum(_REACH * half / places, _SPEED * fast / speeds)
    middle = np.array([(j.upper + j.lower) / 2 for j in joints])
    return Motion(middle, size[:, None] * amplitude, phase, seconds)


def recorded(model, joints: list[Joint], motion: Motion, rng: np.random.Generator) -> Recorded:
    """The experiment, sampled as its encoders and torque sensors would."""
    data = mujoco.MjData(model)
    places = [model.joint(j.name).qposadr[0] for j in joints]
    wheels = [model.joint(j.name).dofadr[0] for j in joints]
    strongest = np.array([j.effort for j in joints])
    data.qpos[places] = motion.at(0.0)
    mujoco.mj_forward(model, data)
    inertia = inertias(model, data)
    stiffness, damping = _BANDWIDTH_RAD_S**2 * inertia, 1.4 * _BANDWIDTH_RAD_S * inertia
    goal, goal_speed = data.qpos.copy(), np.zeros(model.nv)
    names = tuple(model.joint(i).name for i in range(model.njnt))
    drives = np.isin(np.arange(model.nv), wheels)
    stamps, q, qd, effort = [], [], [], []
    for step in range(int(motion.seconds / _STEP_S)):
        t = step * _STEP_S
        goal[places] = motion.at(t)
        goal_speed[wheels] = (motion.at(t + _STEP_S) - goal[places]) / _STEP_S
        torque = stiffness * (goal - data.qpos) + damping * (goal_speed - data.qvel)
        torque += data.qfrc_bias
        torque[wheels] = np.clip(torque[wheels], -strongest, strongest)
        data.qfrc_applied[:] = torque
        if step % _RECORDED_EVERY == 0:
            stamps.append(1_700_000_000_000_000_000 + int(t * 1e9))
            q.append(data.qpos.copy())
            qd.append(data.qvel.copy())
            noise = np.zeros(model.nv)
            noise[wheels] = rng.normal(0, _SHARE["noise"] * strongest)
            effort.append(np.where(drives, torque + noise, 0.0))
        mujoco.mj_step(model, data)
    exact = np.round(np.array(q) / _ENCODER_RAD) * _ENCODER_RAD
    return Recorded(names, np.array(stamps), exact, np.array(qd), np.array(effort))


def write_bag(path: Path, drivers: list[Recorded], storage: StoragePlugin) -> None:
    """A rosbag2 folder with /joint_states, on which every driver publishes its joints."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    state = store.types["sensor_msgs/msg/JointState"]
    header, stamp = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    with Writer(path, version=9, storage_plugin=storage) as bag:
        topic = bag.add_connection("/joint_states", state.__msgtype__, typestore=store)
        for k, at in enumerate(drivers[0].stamp_ns):
            head = header(stamp(int(at // 1_000_000_000), int(at % 1_000_000_000)), "")
            for one in drivers:
                message = state(head, list(one.names), one.q[k], one.qd[k], one.effort[k])
                bag.write(topic, int(at), store.serialize_cdr(message, state.__msgtype__))


def main(arguments: list[str] | None = None) -> None:
    """Simulate and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("urdf", type=Path)
    parser.add_argument("bag", type=Path)
    parser.add_argument("--seed", type=int, default=0, help="of motion and noise")
    parser.add_argument("--arm-seed", type=int, default=0, help="of the arm's true parameters")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--sqlite", action="store_true", help="rosbag2's older storage, not MCAP")
    given = parser.parse_args(arguments)
    root = ElementTree.parse(given.urdf).getroot()
    joints = driven_joints(root)
    model = arm_of(root, joints, np.random.default_rng(given.arm_seed))
    rng = np.random.default_rng([given.arm_seed, given.seed])
    found = recorded(model, joints, motion_of(joints, given.seconds, rng), rng)
    write_bag(given.bag, [found], StoragePlugin.SQLITE3 if given.sqlite else StoragePlugin.MCAP)
    print(f"{given.bag}: {len(found.q)} samples of {', '.join(found.names)}")


if __name__ == "__main__":
    main()
