"""Effects of a joint that slides are told in N and m."""

import pytest

from ident.dynamics.parameters import of_joint
from ident.gap.results.held_out_error import Share
from ident.model.records import EffectRecord
from ident.workflows.gap_json import in_own_units, where_content


@pytest.mark.parametrize(
    ("unit", "own"),
    [
        ("N m", "N"),
        ("N m s/rad", "N s/m"),
        ("N m (s/rad)^2", "N (s/m)^2"),
        ("N m/rad", "N/m"),
        ("rad/(N m)", "m/N"),
        ("rad/s", "m/s"),
        ("kg m^2", "kg"),
        ("kg m", "kg m"),
        ("s", "s"),
        ("1", "1"),
    ],
)
def test_units_of_a_joint_that_slides(unit, own):
    assert of_joint(unit, True) == own
    assert of_joint(unit, False) == unit


def entry(name, joints, **units):
    parameters = {k: {"value": 1.0, "sd": 0.1, "unit": u} for k, u in units.items()}
    return {"name": name, "joints": joints, "parameters": parameters}


def test_only_numbers_of_that_joint_change_their_unit():
    sliding = [False, True]
    entries = [
        entry("torque_offset", [1], offset="N m"),
        entry("torque_offset", [2], offset="N m"),
        entry("gravity_tilt", [1, 2], tilt_x="rad"),
        entry("contact", [1, 2], torque_1="N m", torque_2="N m", start="s"),
        {"name": "dropped_samples", "joints": [], "parameters": {"count": 3}},
    ]
    found = in_own_units(entries, sliding)
    units = [{k: p["unit"] for k, p in e["parameters"].items()} for e in found[:4]]
    assert units == [
        {"offset": "N m"},
        {"offset": "N"},
        {"tilt_x": "rad"},
        {"torque_1": "N m", "torque_2": "N", "start": "s"},
    ]
    assert found[4] == entries[4]


def test_the_region_of_a_joint_that_slides_is_in_metres():
    shares = [Share(0, "|qd| > 0.1 rad/s", 0.6), Share(1, "|qd| > 0.1 rad/s", 0.4)]
    regions = [w["region"] for w in where_content(shares, [False, True])]
    assert regions == ["|qd| > 0.1 rad/s", "|qd| > 0.1 m/s"]


def test_a_model_file_tells_an_effect_in_the_units_of_its_joint():
    record = EffectRecord(
        name="joint_spring",
        joints=(2,),
        parameters={"stiffness": 3.0},
        units={"stiffness": "N m/rad"},
        rows=(2,),
    )
    assert record.content([False, True])["units"] == {"stiffness": "N/m"}
    assert record.content([True, False])["units"] == {"stiffness": "N m/rad"}
