"""Two joints with position servos, moved by MuJoCo: another hand than the simulation that fits."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from wamctl.arm.recorder import write_recording
from wamctl.arm.recording import Command, Recording

JOINTS = ("shoulder", "elbow")
STIFFNESS, DAMPING, COULOMB, ARMATURE = 15.0, 0.7, 0.12, 0.02
STEP_RAD = 2 * np.pi / 4096
DELAY_STEPS, PERIOD_STEPS, TIMESTEP_S = 15, 20, 0.001

URDF = """<robot name="two_servos">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.12 0 0"/><mass value="0.5"/>
    <inertia ixx="1e-4" iyy="3e-3" izz="3e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="0.3"/>
    <inertia ixx="1e-4" iyy="2e-3" izz="2e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="20" velocity="10"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.25 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="20" velocity="10"/></joint>
</robot>
"""

MJCF = f"""<mujoco><option timestep="{TIMESTEP_S}" integrator="implicitfast"/>
  <default><joint axis="0 1 0" damping="{DAMPING}" frictionloss="{COULOMB}" armature="{ARMATURE}"
    solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
    <position kp="{STIFFNESS}"/></default>
  <worldbody><body><joint name="shoulder"/>
    <inertial pos="0.12 0 0" mass="0.5" diaginertia="1e-4 3e-3 3e-3"/>
    <body pos="0.25 0 0"><joint name="elbow"/>
      <inertial pos="0.1 0 0" mass="0.3" diaginertia="1e-4 2e-3 2e-3"/></body></body></worldbody>
  <actuator><position joint="shoulder"/><position joint="elbow"/></actuator></mujoco>"""


def commands(seconds: float, seed: int, step: float = 0.0) -> np.ndarray:
    """Sums of sines at 50 Hz beside a step each second [rad], shape (S, 2)."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * 50)) / 50
    hz = np.array([0.13, 0.31, 0.72, 1.4])
    size = np.array([0.5, 0.25, 0.12, 0.05])
    phase = rng.uniform(0, 2 * np.pi, (2, 4))
    steps = step * rng.standard_normal((len(t) // 50 + 1, 2))
    return np.sin(2 * np.pi * hz * t[:, None, None] + phase) @ size + steps[np.arange(len(t)) // 50]


Hidden = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Torque that the joints feel beside all others, from their positions and speeds."""


def recording(
    seconds: float = 24.0, seed: int = 0, hidden: Hidden | None = None, *,
    step: float = 0.0, elbow_limit: float = np.inf, fed_forward: float = 0.0, gain: float = 1.0,
) -> Recording:  # fmt: skip
    """What such an arm's log holds: commands and 12-bit positions at 50 Hz, no torque.

    Args:
        seconds: its length.
        seed: of the motion.
        hidden: torque that the joints feel as well [N m].
        step: size of a step of the commands each second [rad].
        elbow_limit: of the elbow's servo [N m].
        fed_forward: part of the links' weight, where they should be, that the servos carry.
        gain: times the usual stiffness of the elbow's servo.
    """
    arm = mujoco.MjModel.from_xml_string(MJCF)
    arm.actuator_gainprm[1, 0] = gain * STIFFNESS
    arm.actuator_biasprm[1, 1] = -gain * STIFFNESS
    if np.isfinite(elbow_limit):
        arm.actuator_forcelimited[1], arm.actuator_forcerange[1] = 1, (-elbow_limit, elbow_limit)
    state, still = mujoco.MjData(arm), mujoco.MjData(arm)
    wanted = commands(seconds, seed, step)
    state.qpos[:] = wanted[0]
    q = np.empty_like(wanted)
    sent = np.repeat(wanted, PERIOD_STEPS, axis=0)
    for k in range(len(sent)):
        if k % PERIOD_STEPS == 0:
            q[k // PERIOD_STEPS] = np.round(state.qpos / STEP_RAD) * STEP_RAD
        asked = sent[max(k - DELAY_STEPS, 0)]
        state.ctrl[:] = asked
        if fed_forward:
            still.qpos[:] = asked
            mujoco.mj_forward(arm, still)
            state.ctrl += fed_forward * still.qfrc_bias / STIFFNESS
        if hidden is not None:
            state.qfrc_applied[:] = hidden(state.qpos, state.qvel)
        mujoco.mj_step(arm, state)
    stamps = (np.arange(len(q)) * 20_000_000).astype(np.int64)
    files = {"robot.urdf": URDF.encode()}
    return Recording(
        JOINTS, stamps, q, None, None, Command(stamps, wanted, None, None), attachments=files
    )


def log(path: Path, seconds: float = 24.0, seed: int = 0) -> Path:
    """The same as a file."""
    write_recording(path, recording(seconds, seed))
    return path
