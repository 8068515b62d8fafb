"""The WAM as the truth, and recordings of it."""

from pathlib import Path

import numpy as np
import pytest
from synthetic_arm import Truth, motion, recording

from ident.model.arm import arm_from_file
from wamctl.arm.config import load_arm_file
from wamctl.arm.recording import Recording


@pytest.fixture(scope="session")
def wam() -> Truth:
    file = load_arm_file("wam7.yaml")
    assert file.simulation is not None
    friction = file.simulation
    arm = arm_from_file(Path("wam7.yaml"), ())
    return Truth(arm, np.array(friction.viscous_nm_s_rad), np.array(friction.coulomb_nm))


@pytest.fixture(scope="session")
def clean(wam: Truth) -> Recording:
    """One period at 250 Hz without any noise."""
    t, q, qd, qdd = motion(20.0, 250.0)
    return recording(wam.arm.robot.joint_names, t, q, wam.torque(q, qd, qdd))


@pytest.fixture(scope="session")
def noisy(wam: Truth) -> Recording:
    """One period at 250 Hz, encoder counts, and noise that differs from joint to joint."""
    t, q, qd, qdd = motion(20.0, 250.0)
    rng = np.random.default_rng(3)
    size = np.array([2.0, 2.0, 1.0, 1.0, 0.2, 0.2, 0.1])
    tau = wam.torque(q, qd, qdd) + size * rng.normal(size=q.shape)
    counts = 2 * np.pi / (4096 * 20)
    return recording(wam.arm.robot.joint_names, t, np.round(q / counts) * counts, tau)
