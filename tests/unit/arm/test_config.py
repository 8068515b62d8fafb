"""The configuration: shipped files load, and bad ones say everything that is wrong."""

import pytest
import yaml

from wamctl.arm.config import find_file, load_arm_file, load_robot_file
from wamctl.arm.errors import ConfigurationError


@pytest.fixture
def content():
    return yaml.safe_load(find_file("wam7.yaml").read_text())


def write(folder, content):
    path = folder / "arm.yaml"
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return path


def test_the_shipped_arm_loads_by_its_bare_name():
    arm = load_arm_file("wam7.yaml")
    assert arm.arm == "wam7"
    assert len(arm.robot.joints) == 7


def test_an_arm_without_drives_is_enough_for_identification(tmp_path, content):
    small = {"arm": "mine", "robot": content["robot"]}
    assert load_robot_file(write(tmp_path, small)).transmission is None


def test_the_model_is_frozen():
    with pytest.raises(ValueError, match="frozen"):
        load_arm_file("wam7.yaml").bus.period_s = 1  # pyright: ignore[reportAttributeAccessIssue]


def test_every_fault_is_reported_at_once(tmp_path, content):
    content["limits"]["velocity_rad_s"][2] = -1.0
    content["bus"]["colour"] = "red"
    del content["safety"]["braking_s"]
    path = write(tmp_path, content)
    with pytest.raises(ConfigurationError) as caught:
        load_arm_file(path)
    assert str(caught.value) == (
        f"{path}: 3 faults:\n"
        "  - bus.colour: unknown key\n"
        "  - limits.velocity_rad_s.2: -1.0 should be greater than 0\n"
        "  - safety.braking_s: missing"
    )


def test_lists_of_another_length_and_crossed_limits_are_refused(tmp_path, content):
    content["limits"]["acceleration_rad_s2"].pop()
    content["limits"]["position_lower_rad"][0] = 3.0
    path = write(tmp_path, content)
    with pytest.raises(ConfigurationError) as caught:
        load_arm_file(path)
    assert caught.value.faults == [
        "limits.acceleration_rad_s2: 6 entries for 7 joints",
        "limits: position_lower_rad 3 rad of joint 1 is not below position_upper_rad 2.6 rad",
    ]


def test_a_missing_file_lists_the_shipped_ones():
    with pytest.raises(ConfigurationError, match=r"^wam8\.yaml: no such file, .*wam7\.yaml.*\)\.$"):
        load_arm_file("wam8.yaml")


def test_broken_yaml_names_the_line(tmp_path):
    path = write(tmp_path, "arm: wam7\nrobot: [1, 2\nbus: 3\n")
    with pytest.raises(ConfigurationError, match=r"not valid YAML in line 3, column 4 \("):
        load_arm_file(path)


def test_infinite_limits_are_refused(tmp_path, content):
    content["limits"]["tool_speed_m_s"] = float("inf")
    with pytest.raises(ConfigurationError, match=r"limits\.tool_speed_m_s: .*finite"):
        load_arm_file(write(tmp_path, content))


def test_yaml_1_1_traps_are_known():
    """`1e-3` is a string and `off` is false for PyYAML: a number needs its point."""
    assert yaml.safe_load("a: 1e-3\nb: 1.0e-3\nc: off") == {"a": "1e-3", "b": 0.001, "c": False}
