"""Two joints that torque drives, moved by MuJoCo; the elbow's gears may give behind its encoder."""

import mujoco
import numpy as np

import ident

JOINTS = ("shoulder", "elbow")
VISCOUS, COULOMB, ROTOR = 0.4, 0.15, 0.01
FINE_S, SAMPLE_S = 0.0001, 0.004
STEP_RAD = 2 * np.pi / 2**16
GAINS = np.array([60.0, 30.0]), np.array([4.0, 2.0])

URDF = """<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>
    <inertia ixx="1e-3" iyy="2e-2" izz="2e-2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="0.9"/>
    <inertia ixx="1e-3" iyy="1e-2" izz="1e-2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="60" velocity="10"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="60" velocity="10"/></joint>
</robot>
"""


def friction_of(viscous: float, coulomb: float, softness: float = 5e-4) -> str:
    """Friction of a joint; MuJoCo lets it turn round the softer, the longer `softness` [s]."""
    return (
        f'damping="{viscous}" frictionloss="{coulomb}" solreffriction="{softness} 1"'
        ' solimpfriction="0.9999 0.9999 0.001 0.5 2"'
    )


FRICTION = friction_of(VISCOUS, COULOMB)


def mjcf(stiffness: float | None, friction: str = FRICTION) -> str:
    """The arm; where the gears give, a rotor before the elbow's link, and a spring between them."""
    link = """<inertial pos="0.15 0 0" mass="0.9" diaginertia="1e-3 1e-2 1e-2"/>"""
    elbow = f"""<joint name="elbow" {friction}/>{link}"""
    if stiffness is not None:
        twist = f"""stiffness="{stiffness}" damping="{2e-3 * stiffness}" """
        elbow = f"""<joint name="elbow" armature="{ROTOR}" {friction}/>
          <inertial pos="0 0 0" mass="1e-6" diaginertia="1e-7 1e-7 1e-7"/>
          <body><joint name="twist" {twist}/>{link}</body>"""
    option = f"""<option timestep="{FINE_S}" integrator="implicitfast"/>"""
    return f"""<mujoco>{option}<default><joint axis="0 1 0"/></default>
      <worldbody><body><joint name="shoulder" {friction}/>
        <inertial pos="0.2 0 0" mass="1.5" diaginertia="1e-3 2e-2 2e-2"/>
        <body pos="0.4 0 0">{elbow}</body></body></worldbody>
      <actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator></mujoco>"""


def recording(
    seconds: float, seed: int = 4, stiffness: float | None = None, friction: str = FRICTION
) -> ident.Recording:
    """Positions in steps, and the torque that was given from each of them on, at 250 Hz.

    Args:
        seconds: its length.
        seed: of the motion.
        stiffness: of the elbow's gears [N m/rad]; None: they do not give.
        friction: of both joints.
    """
    arm = mujoco.MjModel.from_xml_string(mjcf(stiffness, friction))
    state = mujoco.MjData(arm)
    t = np.arange(0.0, seconds, SAMPLE_S)
    hz, size = np.array([0.13, 0.31, 0.72, 1.4]), np.array([0.5, 0.25, 0.12, 0.08])
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (2, 4))
    wanted = np.sin(2 * np.pi * hz * t[:, None, None] + phases) @ size
    state.qpos[:2] = wanted[0]
    q, torque = np.empty_like(wanted), np.zeros_like(wanted)
    speed, before = np.gradient(wanted, t, axis=0), wanted[0]
    for k in range(len(t)):
        q[k] = np.round(state.qpos[:2] / STEP_RAD) * STEP_RAD
        rate = (q[k] - before) / SAMPLE_S
        before = q[k]
        torque[k] = GAINS[0] * (wanted[k] - q[k]) + GAINS[1] * (speed[k] - rate)
        state.ctrl[:] = torque[k]
        for _ in range(round(SAMPLE_S / FINE_S)):
            mujoco.mj_step(arm, state)
    return ident.Recording(t, q, torque, JOINTS, commanded=True)
