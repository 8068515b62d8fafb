"""All faults of a configuration at once, before any bus is opened."""

import pytest
import yaml

from wamctl.arm.config import find_file
from wamctl.arm.errors import ConfigurationError
from wamctl.experiment.preflight import load_arm, prepare


@pytest.fixture
def write(tmp_path):
    def written(**changes):
        content = yaml.safe_load(find_file("wam7.yaml").read_text())
        content["robot"]["urdf"] = str(find_file("wam7.urdf"))
        content["drives"]["dictionary"] = str(find_file("puck4.eds"))
        content["excitation"]["trajectory"] = str(find_file("wam7-excitation.yaml"))
        for section, values in changes.items():
            content[section] |= values
        path = tmp_path / "arm.yaml"
        path.write_text(yaml.safe_dump(content))
        return path

    return written


def faults_of(action):
    with pytest.raises(ConfigurationError) as error:
        action()
    assert error.value.exit_code == 3
    return error.value.faults


def test_the_shipped_arm_passes():
    prepared = prepare("wam7.yaml")
    assert prepared.load.worst < 0.6
    counted = prepared.excitation.counted
    assert counted.stop - counted.start == 30_000


def test_every_fault_is_listed_at_once(write):
    path = write(
        drives={"node_ids": [1, 2, 3, 4, 5, 6, 6], "sync_loss_ms": 4, "dictionary": "none.eds"},
        limits={"elbow_frame": "elbow", "tool_frame": "tool"},
    )
    faults = faults_of(lambda: load_arm(path))
    assert faults[0].startswith("none.eds: not a readable EDS file (")
    assert faults[1:] == [
        "drives.node_ids: two drives share a node",
        "drives.sync_loss_ms: 4 ms is less than 3 cycles (6 ms), so that one late SYNC would stop "
        "the arm",
        "limits.elbow_frame: the URDF has no link 'elbow'",
        "limits.tool_frame: the URDF has no link 'tool'",
    ]


@pytest.mark.parametrize(
    ("row", "column", "ratio", "joint", "torque", "effort"),
    [(1, 2, -168.155, "3 (shoulder yaw)", 332.9, 60.5), (2, 6, 1.0, "7 (palm yaw)", 3.168, 1.37)],
)
def test_a_ratio_that_the_urdf_contradicts(write, row, column, ratio, joint, torque, effort):
    matrix = yaml.safe_load(find_file("wam7.yaml").read_text())["transmission"]["motor_from_joint"]
    matrix[row][column] = ratio
    path = write(transmission={"motor_from_joint": matrix})
    (fault,) = faults_of(lambda: load_arm(path))
    assert fault.startswith("transmission.motor_from_joint and limits.motor_torque_nm: the motors")
    assert f"joint {joint}" in fault
    assert fault.endswith(
        f"{torque} N m, above 2 times the {effort} N m that the URDF lets it bear"
    )


def test_a_bandwidth_beyond_what_the_loop_can_follow(write):
    bandwidth = [16.0, 12.0, 30.0, 200.0, 60.0, 55.0, 120.0]
    path = write(controller={"bandwidth_rad_s": bandwidth})
    assert faults_of(lambda: load_arm(path)) == [
        "controller.bandwidth_rad_s: 200 rad/s of joint 4 (elbow pitch) is too fast for a loop "
        "that lags by 8.0 ms: its velocity would lag by 2.5 rad (limit 1 rad)"
    ]


def test_a_bandwidth_that_would_let_the_released_joint_fall(write):
    path = write(controller={"bandwidth_rad_s": [16.0, 12.0, 30.0, 2.0, 60.0, 55.0, 120.0]})
    assert faults_of(lambda: load_arm(path)) == [
        "controller.bandwidth_rad_s: 2 rad/s of joint 4 (elbow pitch) would let it sink at up to "
        "11 rad/s when it is released (limit 3 rad/s)"
    ]


def test_a_missing_trajectory(write):
    path = write(excitation={"trajectory": None})
    assert faults_of(lambda: prepare(path)) == [
        "arm.yaml: excitation.trajectory: unset, and no --trajectory was given"
    ]


def test_a_trajectory_beyond_the_limits_and_a_bus_that_is_too_slow(write):
    path = write(limits={"tool_speed_m_s": 0.5}, bus={"period_s": 0.001})
    bus, *motion = faults_of(lambda: prepare(path))
    assert bus.startswith("bus: the plan takes 114% of it")
    assert any("speed of tool (wam/link7_dh)" in fault for fault in motion)


def test_a_classic_arm_passes_as_well():
    assert prepare("wam7-classic.yaml").load.worst < 0.6
