"""The worked examples of the protocol's manuals, and round trips over the whole range."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wamctl.puck import frames
from wamctl.puck.enumerations import Group, MotorMode, Status
from wamctl.puck.errors import FrameError
from wamctl.puck.properties import motor_properties, safety_properties

SAFETY_MODULE = 10

VALUE_32 = st.integers(-(2**31), 2**31 - 1)
POSITION = st.integers(-(2**21), 2**21 - 1)
TORQUE = st.integers(-8191, 8191)


def test_wake_all():
    data = frames.encode_set(motor_properties(200)["STAT"], Status.READY, width=2)
    assert frames.to_group(Group.ALL_ACTUATORS) == 0x400
    assert data == bytes.fromhex("85 00 02 00")


def test_torque_mode():
    data = frames.encode_set(motor_properties(200)["MODE"], MotorMode.TORQUE, width=2)
    assert data == bytes.fromhex("88 00 02 00")


def test_get_position():
    assert frames.encode_get(motor_properties(200)["P"]) == bytes.fromhex("30")


def test_torque_warning_limit_of_the_safety_module():
    assert frames.to_node(SAFETY_MODULE) == 0x00A
    data = frames.encode_set(safety_properties(200)["TL1"], 4731, width=2)
    assert data == bytes.fromhex("AF 00 7B 12")


def test_a_set_has_six_bytes_unless_told_otherwise():
    assert frames.encode_set(8, 2) == bytes.fromhex("88 00 02 00 00 00")
    assert frames.encode_set(48, -2) == bytes.fromhex("B0 00 FE FF FF FF")


@pytest.mark.parametrize(
    ("node", "expected"),
    [(1, 0x423), (2, 0x443), (3, 0x463), (4, 0x483), (5, 0x4A3), (6, 0x4C3), (7, 0x4E3)],
)
def test_identifier_of_a_position_reply(node, expected):
    assert frames.to_group(Group.POSITION_FEEDBACK, node) == expected


@pytest.mark.parametrize(
    ("node", "expected"),
    [(1, 0x426), (2, 0x446), (6, 0x4C6), (7, 0x4E6), (SAFETY_MODULE, 0x546)],
)
def test_identifier_of_a_property_reply(node, expected):
    assert frames.to_group(Group.PROPERTY_FEEDBACK, node) == expected


def test_identifiers_of_host_and_safety_broadcast():
    assert [frames.to_node(n) for n in (1, 31)] == [0x001, 0x01F]
    assert frames.to_group(Group.WHOLE_ARM) == 0x404
    assert [frames.to_group(g) for g in (Group.LOWER_TORQUES, Group.UPPER_TORQUES)] == [
        0x401,
        0x402,
    ]
    assert frames.to_group(Group.ALL_ACTUATORS, SAFETY_MODULE) == 0x540


@given(st.integers(0, 0x7FF))
def test_identifier_round_trip(number):
    assert frames.identifier(frames.address(number)) == number


@given(st.integers(0, 127), VALUE_32)
def test_reply_round_trip(property_id, value):
    assert frames.decode_reply(property_id, frames.encode_set(property_id, value)) == value


@given(st.integers(0, 127), st.integers(-(2**15), 2**15 - 1))
def test_short_reply_is_sign_extended_from_its_last_byte(property_id, value):
    data = frames.encode_set(property_id, value, width=2)
    assert len(data) == 4
    assert frames.decode_reply(property_id, data) == value


@pytest.mark.parametrize(
    ("counts", "data"),
    [
        (0, "00 00 00"),
        (1, "00 00 01"),
        (-1, "3F FF FF"),
        (74565, "01 23 45"),
        (2**21 - 1, "1F FF FF"),
        (-(2**21), "20 00 00"),
    ],
)
def test_packed_position(counts, data):
    assert frames.decode_positions(bytes.fromhex(data)) == (counts,)


def packed(counts):
    return (counts & 0x3FFFFF).to_bytes(3, "big")


@given(POSITION, POSITION)
def test_packed_positions_of_motor_and_joint(motor, joint):
    assert frames.decode_positions(packed(motor)) == (motor,)
    assert frames.decode_positions(packed(motor) + packed(joint)) == (motor, joint)


@pytest.mark.parametrize(
    ("torques", "data"),
    [
        ((0, 0, 0, 0), "AA 00 00 00 00 00 00 00"),
        # A = 1: A[13:6] = 0, A[5:0] = 000001 in the upper six bits of byte 2.
        ((1, 0, 0, 0), "AA 00 04 00 00 00 00 00"),
        # B = 1: B[3:0] = 0001 in the upper half of byte 4.
        ((0, 1, 0, 0), "AA 00 00 00 10 00 00 00"),
        # C = 1: C[1:0] = 01 in the upper two bits of byte 6.
        ((0, 0, 1, 0), "AA 00 00 00 00 00 40 00"),
        ((0, 0, 0, 1), "AA 00 00 00 00 00 00 01"),
        ((-1, 0, 0, 0), "AA FF FC 00 00 00 00 00"),
        ((0, -1, 0, 0), "AA 00 03 FF F0 00 00 00"),
        ((0, 0, -1, 0), "AA 00 00 00 0F FF C0 00"),
        ((0, 0, 0, -1), "AA 00 00 00 00 00 3F FF"),
        ((8191, -8191, 8191, -8191), "AA 7F FE 00 17 FF E0 01"),
    ],
)
def test_packed_torques(torques, data):
    assert frames.encode_torques(motor_properties(200)["T"], torques) == bytes.fromhex(data)


def unpacked(data):
    fields = [int.from_bytes(data[1:], "big") >> shift & 0x3FFF for shift in (42, 28, 14, 0)]
    return tuple(f - (1 << 14) if f >> 13 else f for f in fields)


@given(st.lists(TORQUE, min_size=4, max_size=4))
def test_packed_torques_round_trip(torques):
    assert unpacked(frames.encode_torques(42, torques)) == tuple(torques)


@given(st.lists(TORQUE, min_size=0, max_size=4))
def test_missing_torques_are_zero(torques):
    padded = (*torques, 0, 0, 0, 0)[:4]
    assert frames.encode_torques(42, torques) == frames.encode_torques(42, padded)


@given(st.lists(st.integers(-(10**6), 10**6), min_size=4, max_size=4))
def test_torques_saturate(torques):
    sent = unpacked(frames.encode_torques(42, torques))
    assert sent == tuple(max(-8191, min(8191, t)) for t in torques)


def test_the_bytes_of_the_manual_field_by_field():
    a, b, c, d = 0b01_0110_1010_0111, -0b01_0010_0011_0101, 0b00_1111_0000_1111, -1234
    data = frames.encode_torques(42, (a, b, c, d))
    b, d = b & 0x3FFF, d & 0x3FFF
    assert list(data) == [
        0x80 | 42,
        a >> 6,
        (a & 0x3F) << 2 | b >> 12,
        b >> 4 & 0xFF,
        (b & 0xF) << 4 | c >> 10,
        c >> 2 & 0xFF,
        (c & 0x3) << 6 | d >> 8,
        d & 0xFF,
    ]


REFUSED = [
    (
        lambda: frames.to_node(32),
        "The receiver 32 of a Puck frame is outside 0 to 31.",
    ),
    (
        lambda: frames.to_group(3, 40),
        "The sender 40 of a Puck frame is outside 0 to 31.",
    ),
    (lambda: frames.address(0x800), "The identifier 0x800 does not fit into 11 bits."),
    (lambda: frames.encode_get(128), "The property id 128 is outside 0 to 127."),
    (
        lambda: frames.encode_set(42, 40000, width=2),
        "The value 40000 for property 42 is outside -32768 to 32767.",
    ),
    (
        lambda: frames.decode_reply(5, bytes.fromhex("85 00 02")),
        "The answer 85 00 02 has 3 bytes; a property has 4 or 6.",
    ),
    (
        lambda: frames.decode_reply(5, bytes.fromhex("86 00 02 00")),
        "The answer 86 00 02 00 is not for property 5, which was asked for.",
    ),
    (
        lambda: frames.decode_reply(5, bytes.fromhex("85 01 02 00")),
        "The answer 85 01 02 00 has 0x01 where a zero must be.",
    ),
    (
        lambda: frames.decode_positions(b"\x00\x00"),
        "The position 00 00 has 2 bytes; 3 or 6 are possible.",
    ),
    (
        lambda: frames.decode_positions(bytes.fromhex("00 00 00 40 00 00")),
        "The position 40 00 00 has its unused top bits set.",
    ),
    (lambda: frames.encode_torques(42, [0] * 5), "A torque frame holds 4 values, not 5."),
]


@pytest.mark.parametrize(("call", "sentence"), REFUSED)
def test_refused(call, sentence):
    with pytest.raises(FrameError) as error:
        call()
    assert str(error.value) == sentence
    assert error.value.exit_code == 4
