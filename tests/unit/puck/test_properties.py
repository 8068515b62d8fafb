"""The property tables: spot-checked at each break of the firmware, and sound as a whole."""

import pytest

from wamctl.puck.errors import PropertyError
from wamctl.puck.properties import (
    SAFE_ON_EVERY_VERSION,
    motor_properties,
    parse,
    safety_properties,
)
from wamctl.puck.property_tables import COMMON, MOTOR, SAFETY

# Name, and its id before and from the break on; None where the firmware lacks the property.
AT_BREAK = {
    33: [("ZERO", 55, 56), ("IPNM", None, 57)],
    36: [("ZERO", 56, 55), ("IPNM", 57, 108)],
    44: [("POLES", None, 112)],
    50: [("T", 10, 9)],
    61: [("T", 9, 42), ("P", 26, 48), ("CTS", 30, 65), ("IPNM", 108, 83), ("ZERO", 55, None)],
    64: [("CTS", 65, 66)],
    65: [("CTS", 66, 68), ("IPNM", 83, 86), ("PIDX", 68, 70)],
}
SAFETY_BREAKS = {
    33: [("ZERO", 55, 56), ("TL2", 93, 95), ("IFAULT", 100, 102)],
    36: [("ZERO", 56, 55), ("TL2", 95, 93), ("IFAULT", 102, 100)],
    44: [("POLES", None, 112)],
    50: [("T", 10, 9)],
    61: [("ZERO", 55, 42), ("PEN", 85, 43), ("TL1", 92, 47), ("GRPC", 53, 28), ("T", 9, None)],
}


MOTOR_BREAKS = [32, *AT_BREAK]


def cases(breaks):
    return [(b, *row) for b, rows in breaks.items() for row in rows]


@pytest.mark.parametrize(("version", "name", "before", "after"), cases(AT_BREAK))
def test_motor_break(version, name, before, after):
    assert motor_properties(version - 1).ids().get(name) == before
    assert motor_properties(version).ids().get(name) == after


@pytest.mark.parametrize(("version", "name", "before", "after"), cases(SAFETY_BREAKS))
def test_safety_break(version, name, before, after):
    assert safety_properties(version - 1).ids().get(name) == before
    assert safety_properties(version).ids().get(name) == after


@pytest.mark.parametrize(
    ("of", "breaks"),
    [(motor_properties, MOTOR_BREAKS), (safety_properties, [32, *SAFETY_BREAKS])],
)
def test_a_table_changes_at_its_breaks_only(of, breaks):
    changes = [v for v in range(33, 256) if of(v).ids() != of(v - 1).ids()]
    assert [32, *changes] == breaks


def test_every_row_is_there():
    assert len(parse(COMMON) | parse(MOTOR)) == 27
    assert len(parse(COMMON) | parse(SAFETY)) == 20


@pytest.mark.parametrize("of", [motor_properties, safety_properties])
@pytest.mark.parametrize("version", MOTOR_BREAKS)
def test_no_two_properties_share_an_id(of, version):
    numbers = list(of(version).ids().values())
    assert len(set(numbers)) == len(numbers)
    assert all(0 <= n < 128 for n in numbers)


@pytest.mark.parametrize("of", [motor_properties, safety_properties])
@pytest.mark.parametrize("version", MOTOR_BREAKS)
def test_what_may_be_asked_before_the_version_is_known(of, version):
    assert of(version).ids().items() >= SAFE_ON_EVERY_VERSION.items()


@pytest.mark.parametrize("version", [v for v in MOTOR_BREAKS if v >= 61])
def test_the_common_part_is_the_same_on_both(version):
    def common(properties):
        return {n: i for n, i in properties.ids().items() if i < 42}

    assert common(motor_properties(version)) == common(safety_properties(version))


@pytest.mark.parametrize("version", [v for v in MOTOR_BREAKS if v < 61])
def test_before_61_the_safety_puck_shares_the_motor_table(version):
    listed = {n: s.id for n, spans in parse(SAFETY).items() for s in spans if version in s}
    assert safety_properties(version).ids() == motor_properties(version).ids()
    assert listed.items() <= motor_properties(version).ids().items()


@pytest.mark.parametrize("version", [v for v in MOTOR_BREAKS if v >= 61])
@pytest.mark.parametrize("name", ["P", "CTS"])
def test_wide_properties_have_two_numbers(version, name):
    number = motor_properties(version)[name]
    assert number + 1 not in motor_properties(version).ids().values()


REFUSED = [
    (
        lambda: motor_properties(31),
        "The Puck says that its firmware is version 31; the oldest that was released is 32: "
        "check VERS with the Puck out of its monitor.",
    ),
    (
        lambda: motor_properties(32)["IPNM"],
        "Firmware 32 of a motor Puck has no property IPNM: versions 33 to 35, 36 to 60, 61 to 64, "
        "65 and later have it.",
    ),
    (
        lambda: motor_properties(61)["PEN"],
        "Firmware 61 of a motor Puck has no property PEN: versions 32, 33 to 35, 36 to 60 have it.",
    ),
    (
        lambda: safety_properties(200)["LIFT"],
        "Firmware 200 of a safety Puck has no property LIFT: no version is known to.",
    ),
]


@pytest.mark.parametrize(("call", "sentence"), REFUSED)
def test_refused(call, sentence):
    with pytest.raises(PropertyError) as error:
        call()
    assert str(error.value) == sentence
