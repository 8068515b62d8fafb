"""The drives section of a classic arm."""

import pytest
import yaml

from wamctl.arm.config import PuckDrivesSection, find_file, load_arm_file
from wamctl.arm.errors import ConfigurationError


@pytest.fixture
def content():
    return yaml.safe_load(find_file("wam7-classic.yaml").read_text())


def faults(tmp_path, content):
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigurationError) as error:
        load_arm_file(path)
    return error.value.faults


def test_the_shipped_classic_arm_loads():
    drives = load_arm_file("wam7-classic.yaml").drives
    assert isinstance(drives, PuckDrivesSection)
    assert drives.node_ids == (1, 2, 3, 4, 5, 6, 7)


def test_the_classic_arm_is_the_same_arm_but_for_its_drives():
    def without(arm):
        return arm.model_dump(exclude={"arm", "drives"})

    assert without(load_arm_file("wam7.yaml")) == without(load_arm_file("wam7-classic.yaml"))


def test_an_unknown_protocol_lists_the_known_ones(tmp_path, content):
    content["drives"]["protocol"] = "ethercat"
    assert faults(tmp_path, content) == [
        "drives: input tag 'ethercat' found using 'protocol' does not match any of the expected "
        "tags: 'canopen', 'puck'"
    ]


def test_every_fault_of_the_section_is_reported_at_once(tmp_path, content):
    content["drives"]["node_ids"][6] = 10
    content["drives"]["safety_module"]["speed_warning_m_s"] = 1.5
    assert faults(tmp_path, content) == [
        "drives: two Pucks, or a Puck and the safety module, share a node id",
        "drives: safety_module.speed_warning_m_s is above speed_fault_m_s",
    ]


def test_the_place_of_a_fault_is_the_one_in_the_file(tmp_path, content):
    del content["drives"]["home_pose_rad"]
    content["drives"]["firmware"][2] = 31
    content["drives"]["colour"] = "red"
    assert faults(tmp_path, content) == [
        "drives.firmware.2: 31 should be greater than or equal to 32",
        "drives.home_pose_rad: missing",
        "drives.colour: unknown key",
    ]


def test_lists_of_another_length_are_refused(tmp_path, content):
    content["drives"]["torque_units_per_nm"].pop()
    assert faults(tmp_path, content) == ["drives.torque_units_per_nm: 6 entries for 7 joints"]
