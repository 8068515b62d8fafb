"""Identification by simulation where recordings hold the torque that drove the arm."""

import numpy as np
import pytest
from driven_arm import COULOMB, STEP_RAD, URDF, VISCOUS, recording

import ident
from ident.workflows.output_error.driven import is_driven
from wamctl.arm.errors import ConfigurationError


@pytest.fixture
def arm(tmp_path):
    urdf = tmp_path / "two.urdf"
    urdf.write_text(URDF)
    return ident.Arm.from_urdf(urdf)


def test_simulation_finds_the_arm_and_agrees_with_regression(arm):
    found = ident.identify(arm, recording(24.0), method="simulation")
    table = {p["name"]: p for p in found.content["base_parameters"]}
    for j in (1, 2):
        for name, truth in ((f"fv{j}", VISCOUS), (f"fc{j}", COULOMB)):
            assert table[name]["ols"] == pytest.approx(truth, abs=3 * table[name]["sd"] + 2e-3)
    assert max(found.content["rms_q_by_joint"]) < 2 * STEP_RAD
    agree = found.content["agreement"]
    assert agree["within"] >= 0.8 * agree["of"]
    assert found.content["method"] == "simulation"


def test_gears_that_give_are_named_and_sized(arm):
    gap = ident.find_gap(arm, recording(24.0, stiffness=60.0), method="simulation")
    assert gap.verdict == "named"
    (effect,) = gap.content["effects"]
    assert (effect["name"], effect["joints"]) == ("joint_elasticity", [2])
    size = effect["parameters"]["compliance"]
    assert size["value"] == pytest.approx(1 / 60.0, rel=0.15)


def test_an_arm_that_misses_nothing_is_told_so(arm):
    gap = ident.find_gap(arm, recording(24.0), method="simulation")
    assert (gap.verdict, gap.content["effects"]) == ("no_gap", [])


def test_commands_of_servos_are_no_torque():
    log = recording(2.0)
    assert is_driven(log.log)
    servo = ident.Recording(log.t, log.q, log.tau, log.joints, q_command=np.zeros_like(log.q))
    assert not is_driven(servo.log)


def test_what_belongs_to_the_regression_is_not_dropped_in_silence(arm):
    log = recording(2.0)
    with pytest.raises(ConfigurationError, match="load"):
        ident.identify(arm, log, method="simulation", load=(log, [1.0, 0.0, 0.0, 0.0]))
