"""One log with torque and commands: regression and simulation find the same arm."""

import mujoco
import numpy as np
import pytest
from servo_arm import JOINTS, MJCF, URDF

import ident
from ident.output_error.parameters import ROW

FINE_S, SAMPLE_S, DELAY_S = 0.0002, 0.004, 0.02
STEP_RAD = 2 * np.pi / 2**16
Z99 = 2.58
FORM = 0.01
"""Share of a value that no interval holds: what steps of both simulations and filters take."""


def recorded(seconds: float) -> ident.Recording:
    """Commands, 16-bit positions and the mean torque of each sample, at 250 Hz."""
    arm = mujoco.MjModel.from_xml_string(MJCF)
    arm.opt.timestep = FINE_S
    state = mujoco.MjData(arm)
    t = np.arange(0.0, seconds, SAMPLE_S)
    hz, size = np.array([0.13, 0.31, 0.72, 1.4]), np.array([0.5, 0.25, 0.12, 0.08])
    phases = np.random.default_rng(4).uniform(0, 2 * np.pi, (2, 4))
    wanted = np.sin(2 * np.pi * hz * t[:, None, None] + phases) @ size
    state.qpos[:] = wanted[0]
    q, torque = np.empty_like(wanted), np.zeros_like(wanted)
    late, steps = round(DELAY_S / SAMPLE_S), round(SAMPLE_S / FINE_S)
    for k in range(len(t)):
        q[k] = np.round(state.qpos / STEP_RAD) * STEP_RAD
        state.ctrl[:] = wanted[max(k - late, 0)]
        for _ in range(steps):
            mujoco.mj_step(arm, state)
            torque[k] += state.qfrc_actuator / steps
    return ident.Recording(t, q, torque, JOINTS, commanded=True, q_command=wanted)


def test_with_and_without_torque_the_same_arm_is_found(tmp_path):
    urdf = tmp_path / "two.urdf"
    urdf.write_text(URDF)
    arm, log = ident.Arm.from_urdf(urdf), recorded(24.0)
    terms = ["viscous", "coulomb", "rotor_inertia"]
    table = ident.identify(arm, log, terms=terms).content["base_parameters"]
    by_torque = {p["name"]: (p["ols"], p["sd"]) for p in table}
    servos = ident.identify(arm, log, method="simulation").model
    for name, short in (("damping", "fv"), ("coulomb", "fc"), ("armature", "ia")):
        for j in (0, 1):
            if f"{short}{j + 1}" not in by_torque:
                continue  # the first joint's rotor is a part of its link's inertia
            value, sd = by_torque[f"{short}{j + 1}"]
            other, other_sd = servos.value(name)[j], servos.sd[ROW[name], j]
            joint = Z99 * np.hypot(sd, other_sd) + FORM * value
            assert other == pytest.approx(value, abs=joint), (name, j, sd, other_sd)
