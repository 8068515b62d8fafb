"""Torque in steps: what rounding leaves comes again with the motion, and is no gap."""

import numpy as np
import pytest
from pendulum import pendulum

from ident.gap.data.experiment import of_arm
from ident.gap.data.rounding import torque_resolution
from ident.gap.options import Options
from ident.model.arm import arm_from_urdf
from ident.workflows.gap import gap_of
from wamctl.arm.recording import Recording
from wamctl.arm.robot import inverse_dynamics

HZ, PERIOD_S = 200, 6.0
NAMES = ("shoulder", "elbow")
ARM = arm_from_urdf(pendulum(), NAMES, "pendulum.urdf")


def repeated(step):
    """Three periods of a motion; torque with friction, without noise, in steps [N m]."""
    t = np.arange(round(3 * PERIOD_S * HZ)) / HZ
    rates = 2 * np.pi / PERIOD_S * np.array([[1, 3, 5], [2, 3, 7]])
    sizes = np.array([[0.9, 0.5, 0.3], [0.8, 0.5, 0.2]])
    phase = np.array([[0.3, 1.1, 2.0], [0.7, 2.3, 0.2]])
    angle = t[:, None, None] * rates + phase
    q = (sizes * np.sin(angle)).sum(axis=-1)
    qd = (sizes * rates * np.cos(angle)).sum(axis=-1)
    qdd = -(sizes * rates**2 * np.sin(angle)).sum(axis=-1)
    tau = inverse_dynamics(ARM.robot, q, qd, qdd) + 0.4 * np.sign(qd) + 0.3 * qd
    ns = (t * 1e9).astype(np.int64)
    return Recording(NAMES, ns, q, None, np.round(tau / step) * step)


def test_the_steps_of_torque_are_found():
    source = of_arm(ARM, None, [repeated(0.2)], ["log"])
    assert torque_resolution(source) == pytest.approx([0.1, 0.1])


@pytest.mark.parametrize("step", [0.05, 0.2])
def test_rounding_that_comes_again_with_the_motion_is_no_gap(step):
    source = of_arm(ARM, None, [repeated(step)], ["log"])
    content = gap_of(source, Options(null_runs=0), lambda *told: None).content
    assert (content["verdict"], content["effects"], content["unexplained"]) == ("no_gap", [], [])
