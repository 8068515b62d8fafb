"""Configurations and URDFs that switch safety off, or mean something else than they say."""

import copy
import re

import pytest
import yaml

from wamctl.arm.config import find_file, load_arm_file, read_yaml
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import load_robot
from wamctl.arm.urdf.numbers import number_faults
from wamctl.experiment.preflight import load_arm, prepare

SHIPPED = yaml.safe_load(find_file("wam7.yaml").read_text())
URDF = find_file("wam7.urdf").read_text()
HARMLESS = {  # quantities that a larger number does not make more dangerous
    ("limits", "jerk_rad_s3"),
    ("limits", "motor_torque_slew_nm_s"),
    ("limits", "acceleration_rad_s2"),
    ("drives", "sync_loss_ms"),
}

STRICTER_AT_ZERO = ("position_margin_rad", "clearance_m")


def written(folder, content):
    content = copy.deepcopy(content)
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    content["drives"]["dictionary"] = str(find_file("puck4.eds"))
    content["excitation"]["trajectory"] = str(find_file("wam7-excitation.yaml"))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def changed(section, key, value):
    return SHIPPED | {section: SHIPPED[section] | {key: value}}


def cases():
    """Every number of the safety sections, times factors that would switch its check off."""
    factors = (1000.0, 1e300, -1.0, 0.0, float("nan"), float("inf"))
    return [
        (section, key, factor)
        for section in ("safety", "limits", "controller")
        for key, value in SHIPPED[section].items()
        for factor in factors
        if not isinstance(value, str | bool)
        and (section, key) not in HARMLESS
        and (factor != 0.0 or key not in STRICTER_AT_ZERO)
        and (factor not in (0.0, -1.0) or key not in ("position_lower_rad", "position_upper_rad"))
    ]


@pytest.mark.parametrize(("section", "key", "factor"), cases())
def test_a_number_that_would_switch_safety_off_is_refused(tmp_path, section, key, factor):
    value = SHIPPED[section][key]
    new = [v * factor for v in value] if isinstance(value, list) else value * factor
    if key == "missed_cycles":
        new = int(new) if abs(factor) < 1e9 else 10**9
    with pytest.raises(ConfigurationError):
        load_arm(written(tmp_path, changed(section, key, new)))


@pytest.mark.parametrize(
    ("section", "key", "value", "fault"),
    [
        (
            "safety",
            "braking_s",
            80.0,
            "safety.braking_s: 80.0 should be less than or equal to 0.5",
        ),
        (
            "excitation",
            "ramp_s",
            3000.0,
            "excitation.ramp_s: 3000.0 should be less than or equal to",
        ),
        (
            "safety",
            "unaccounted_torque_nm",
            [1.8, 0.5, 0.5, 0.6, 0.08, 0.08, 0.03],
            "safety.unaccounted_torque_nm: 1.8 N m of motor 1 is not below its limit of 1.8 N m",
        ),
        (
            "limits",
            "motor_torque_nm",
            [8.0, 1.8, 1.8, 1.6, 0.6, 0.6, 0.0916],
            "limits.motor_torque_nm: 8 N m of motor 1 is above 5 times the drive's rated torque, "
            "7.45 N m",
        ),
    ],
)
def test_the_sentence_tells_value_and_bound(tmp_path, section, key, value, fault):
    with pytest.raises(ConfigurationError, match=re.escape(fault)):
        load_arm_file(written(tmp_path, changed(section, key, value)))


@pytest.mark.parametrize(
    ("section", "key"),
    [
        ("transmission", "motor_from_joint"),
        ("drives", "node_ids"),
        ("limits", "motor_torque_nm"),
        ("drives", "home_pose_rad"),
    ],
)
def test_an_empty_list_is_no_setting_for_every_joint(tmp_path, section, key):
    with pytest.raises(ConfigurationError, match=f"{section}.{key}: 0 entries for 7 joints"):
        load_arm(written(tmp_path, changed(section, key, [])))


def test_a_key_that_stands_twice_is_refused(tmp_path):
    path = tmp_path / "twice.yaml"
    path.write_text("safety:\n  braking_s: 0.08\n  braking_s: 0.4\n")
    with pytest.raises(ConfigurationError) as error:
        read_yaml(path)
    assert error.value.faults == [
        "not valid YAML in line 3, column 3 (the key 'braking_s' stands twice)"
    ]


def test_a_motion_of_hours_is_refused_before_it_is_checked(tmp_path):
    motion = yaml.safe_load(find_file("wam7-excitation.yaml").read_text())
    slow = tmp_path / "slow.yaml"
    slow.write_text(yaml.safe_dump(motion | {"fundamental_rad_s": 1e-4}))
    with pytest.raises(ConfigurationError) as error:
        prepare(written(tmp_path, SHIPPED), slow)
    assert error.value.faults[0].startswith("the trajectory's period is 6.283e+04 s, above")


@pytest.mark.parametrize(
    ("pattern", "replacement", "fault"),
    [
        (r'mass value="[^"]*"', 'mass value="3,5"', "is '3,5', not a number"),
        (r'mass value="[^"]*"', 'mass value="nan"', "is 'nan', not a number"),
        (r'mass value="[^"]*"', 'mass value="1_0"', "is '1_0', not a number"),
        (r'mass value="[^"]*"', 'mass value="-1"', "is -1, below 0"),
        (r'ixx="[^"]*"', 'ixx="inf"', "is 'inf', not a number"),
        (r'ixx="[^"]*"', "", "is missing"),
        (r'axis xyz="[^"]*"', 'axis xyz="0 0 0"', "which has no direction"),
        (r'axis xyz="[^"]*"', 'axis xyz="0,0,1"', "not three numbers"),
        (r'lower="[^"]*"', 'lower="-2,6"', "is '-2,6', not a number"),
    ],
)
def test_a_number_of_the_urdf_that_cannot_be_meant_is_refused(pattern, replacement, fault):
    broken, count = re.subn(pattern, replacement, URDF)
    assert count > 0
    with pytest.raises(ConfigurationError) as error:
        load_robot(broken)
    assert any(fault in f for f in error.value.faults)


def test_the_axis_of_a_fixed_joint_means_nothing():
    tool = '<link name="t"/><joint name="f" type="fixed"><parent link="wam/link7"/>'
    tool += '<child link="t"/><axis xyz="0 0 0"/></joint></robot>'
    assert number_faults(URDF.replace("</robot>", tool)) == []


@pytest.mark.parametrize("removed", [r'<mass value="[^"]*"\s*/>', r"<inertial>.*?</inertial>"])
def test_a_link_without_mass_is_refused_before_the_arm_moves(tmp_path, removed):
    path = written(tmp_path, SHIPPED)
    broken = re.sub(removed, "", URDF, flags=re.DOTALL)
    assert broken != URDF
    (tmp_path / "light.urdf").write_text(broken)
    content = yaml.safe_load(path.read_text())
    content["robot"]["urdf"] = "light.urdf"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigurationError) as error:
        load_arm(path)
    assert any("mass" in fault for fault in error.value.faults)


def test_the_shipped_urdf_and_arm_pass():
    assert load_arm("wam7.yaml")
    assert load_arm("wam7-classic.yaml")


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('xyz="0 0 -0.396"', 'xyz="0 0 1e400"', "origin xyz of collision shape of link"),
        ('size="3 3 0.1"', 'size="3 0.1"', "size of a collision shape of link"),
        ('radius="0.10"', 'radius="0,10"', "radius of a collision shape of link"),
        ('<box size="3 3 0.1"/>', "<bxo/>", "has no shape (sphere, cylinder, capsule, box, mesh)"),
    ],
)
def test_a_collision_shape_that_does_not_parse_is_refused(old, new, fault):
    assert old in URDF
    with pytest.raises(ConfigurationError, match=re.escape(fault)):
        load_robot(URDF.replace(old, new, 1))


@pytest.mark.parametrize("character", ["\x01", "&", "<"])
def test_a_urdf_that_only_a_lenient_parser_reads_is_refused(character):
    with pytest.raises(ConfigurationError, match="not a readable URDF"):
        load_robot(URDF.replace("</link>", f"{character}</link>", 1))
