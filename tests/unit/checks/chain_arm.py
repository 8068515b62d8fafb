"""Small arms simulated by MuJoCo, and recordings of them: nothing of our own dynamics."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from ident.model.arm import Arm, arm_from_urdf
from ident.recordings.dataset import Dataset
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from wamctl.arm.recording import Recording

Array = NDArray[np.floating]

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
"""Of the joints from the base outwards, again and again; z points up at rest."""


@dataclass(frozen=True)
class Log:
    """A recording that mutations may change.

    Attributes:
        urdf: of the arm that it is taken for.
        t: stamps [s], shape (S,).
        q, tau: position [rad] and torque [N m], shape (S, n).
        names: of the joints.
        complete: false for a file that is cut off.
    """

    urdf: str
    t: Array
    q: Array
    tau: Array
    names: tuple[str, ...]
    complete: bool = True

    def with_(self, **changes) -> "Log":
        return replace(self, **changes)

    def recording(self) -> Recording:
        stamps = np.round(self.t * 1e9).astype(np.int64)
        return Recording(
            self.names, stamps, self.q, None, self.tau, complete=self.complete,
            attachments={"robot.urdf": self.urdf.encode()},
        )  # fmt: skip

    def arm(self) -> Arm:
        return arm_from_urdf(self.urdf, self.names, "arm.urdf")

    def dataset(self, arm: Arm, name: str = "log") -> Dataset:
        return dataset_for(arm, summarise_log(self.recording(), name))


def names_of(joints: int) -> tuple[str, ...]:
    return tuple(f"joint_{k + 1}" for k in range(joints))


def urdf_of(joints: int, masses: Array | None = None, reach: float = 2.9, size: float = 1.0) -> str:
    """A chain whose links become lighter outwards.

    Args:
        joints: number of joints.
        masses: of the links [kg].
        reach: limit of the positions [rad].
        size: length of the links beside those of an arm of 0.3 m each.
    """
    masses = 5.0 * size**3 * 0.7 ** np.arange(joints) if masses is None else masses
    parts = ['<robot name="chain"><link name="base"/>']
    for k, name in enumerate(names_of(joints)):
        parent = "base" if k == 0 else f"link_{k}"
        m, a = float(masses[k]), 0.3 * size
        wide, slim = m * a**2 / 12, m * (0.3 * a) ** 2 / 10
        parts.append(f"""
  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="link_{k + 1}"/>
    <origin xyz="{0.02 * size} {0.01 * size} {a if k else 0.1}"/><axis xyz="{AXES[k % 6]}"/>
    <limit lower="{-reach}" upper="{reach}" velocity="6" effort="200"/></joint>
  <link name="link_{k + 1}"><inertial>
    <origin xyz="{0.06 * a * (1 + k % 2)} {0.04 * a} {0.45 * a}"/><mass value="{m}"/>
    <inertia ixx="{wide}" iyy="{1.1 * wide}" izz="{slim}" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>""")
    return "".join(parts) + "</robot>"


def motion(
    t: Array, joints: int, rng: np.random.Generator, speed: float = 1.0
) -> tuple[Array, ...]:
    """Sums of five sines for each joint: position, velocity, acceleration."""
    rate = 2 * np.pi * speed * np.arange(1, 6) / 10.0
    amplitude = rng.uniform(0.15, 0.4, (joints, 5)) / np.sqrt(np.arange(1, 6))
    phase = rng.uniform(0, 2 * np.pi, (joints, 5))
    turn = t[:, None, None] * rate + phase
    q = (amplitude * np.sin(turn)).sum(axis=2) + rng.uniform(-0.5, 0.5, joints)
    qd = (amplitude * rate * np.cos(turn)).sum(axis=2)
    qdd = -(amplitude * rate**2 * np.sin(turn)).sum(axis=2)
    return q, qd, qdd


def inverse(urdf: str, q: Array, qd: Array, qdd: Array, gravity=(0, 0, -9.81)) -> Array:
    """MuJoCo's torque along a motion [N m]; gravity may change from sample to sample."""
    model = mujoco.MjModel.from_xml_string(urdf)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.jnt_limited[:] = 0
    data = mujoco.MjData(model)
    pull = np.broadcast_to(np.asarray(gravity, dtype=float), (len(q), 3))
    tau = np.empty_like(q)
    for s in range(len(q)):
        model.opt.gravity[:] = pull[s]
        data.qpos[:], data.qvel[:], data.qacc[:] = q[s], qd[s], qdd[s]
        mujoco.mj_inverse(model, data)
        tau[s] = data.qfrc_inverse
    return tau


@dataclass(frozen=True)
class Experiment:
    """A chain that moves, and how it is measured.

    Attributes:
        joints: number of joints.
        seconds: length of the recording [s].
        rate_hz: of the samples.
        seed: of motion and noise.
        friction: Coulomb and viscous friction, beside the torque.
        noise: of the torque sensor, beside the torque.
        speed: of the motion; 1 repeats every 10 s.
        size: of the arm.
        true_urdf: the arm that moves, where it is not the one that is described.
        gravity: function of the stamps that gives the pull [m/s^2], shape (S, 3).
    """

    joints: int = 3
    seconds: float = 12.0
    rate_hz: float = 100.0
    seed: int = 0
    friction: float = 0.05
    noise: float = 0.01
    speed: float = 1.0
    size: float = 1.0
    true_urdf: str | None = None
    gravity: Callable[[Array], object] | None = None

    def log(self) -> Log:
        """Its recording."""
        rng = np.random.default_rng(self.seed)
        urdf = urdf_of(self.joints, size=self.size)
        t = np.arange(round(self.seconds * self.rate_hz)) / self.rate_hz
        q, qd, qdd = motion(t, self.joints, rng, self.speed)
        pull = (0, 0, -9.81) if self.gravity is None else self.gravity(t)
        tau = inverse(self.true_urdf or urdf, q, qd, qdd, pull)
        scale = np.sqrt(np.mean(tau**2, axis=0))
        brisk = np.sqrt(np.mean(qd**2, axis=0))
        tau = tau + self.friction * scale * (np.tanh(qd / (0.02 * brisk)) + qd / brisk)
        tau = tau + self.noise * scale * rng.normal(size=tau.shape)
        counts = 2 * np.pi / 2**17
        return Log(urdf, t, np.round(q / counts) * counts, tau, names_of(self.joints))
