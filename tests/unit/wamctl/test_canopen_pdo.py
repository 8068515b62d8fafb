"""Process data: mapping, wiring and bytes."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wamctl.arm.config import CanopenDrivesSection, StopInputSection, load_arm_file
from wamctl.canopen import pdo

DRIVES = load_arm_file("wam7.yaml").drives
I16 = st.integers(-(2**15), 2**15 - 1)
SEVEN = st.lists(I16, min_size=7, max_size=7)


def wired(**changes):
    return DRIVES.model_copy(update=changes)


def written(drives, slot):
    return [
        (str(entry), value)
        for entry, value in pdo.settings(pdo.wiring(drives, slot), drives.node_ids[slot])
    ]


def test_a_group_pdo_has_dummies_around_the_drives_own_slot():
    settings = written(wired(temperature_limit_c=None), 5)  # node 6: second of the second group
    assert settings[:9] == [
        ("0x1400:1", 0x80000300),
        ("0x1600:0", 0),
        ("0x1600:1", 0x00030010),
        ("0x1600:2", 0x60710010),
        ("0x1600:3", 0x00030010),
        ("0x1600:4", 0x00030010),
        ("0x1600:0", 4),
        ("0x1400:2", 1),
        ("0x1400:1", 0x00000300),
    ]
    assert settings[9:16] == [
        ("0x1401:1", 0x80000306),
        ("0x1601:0", 0),
        ("0x1601:1", 0x60400010),
        ("0x1601:2", 0x60600008),
        ("0x1601:0", 2),
        ("0x1401:2", 255),
        ("0x1401:1", 0x00000306),
    ]
    assert settings[16:25] == [
        ("0x1402:1", 0x80000500),
        ("0x1602:0", 0),
        *((f"0x1602:{k + 1}", value) for k, (_, value) in enumerate(settings[2:6])),
        ("0x1602:0", 4),
        ("0x1402:2", 255),
        ("0x1402:1", 0x00000500),
    ]
    assert settings[25] == ("0x1403:1", 0x80000506)


def test_positions_come_with_every_sync():
    settings = written(wired(temperature_limit_c=None), 5)
    assert settings[26:] == [
        ("0x1800:1", 0xC0000186),
        ("0x1A00:0", 0),
        ("0x1A00:1", 0x60410010),
        ("0x1A00:2", 0x60640020),
        ("0x1A00:0", 2),
        ("0x1800:2", 1),
        ("0x1800:1", 0x40000186),
        ("0x1801:1", 0xC0000286),
        ("0x1802:1", 0xC0000386),
        ("0x1803:1", 0xC0000486),
    ]


def test_temperatures_come_now_and_then_and_not_all_at_once():
    event = [dict(written(DRIVES, slot))["0x1801:5"] for slot in range(7)]
    assert event == [500, 513, 526, 539, 552, 565, 578]


def test_one_pdo_per_drive_carries_controlword_and_torque():
    received = pdo.wiring(wired(wiring="pdo_per_drive"), 2).received
    assert [(p.cob_id, p.transmission, p.length) for p in received] == [
        (0x203, 1, 4),
        (0x303, 255, 4),
    ]


def test_each_pdo_of_a_wiring_has_an_identifier_of_its_own():
    for wiring in ("group_pdos", "pdo_per_drive"):
        drives = wired(wiring=wiring, stop_input=StopInputSection(node_id=1, bit=0))
        sent = [p.cob_id for slot in range(7) for p in pdo.wiring(drives, slot).sent]
        assert len(set(sent)) == len(sent)
        assert not set(sent) & pdo.received_ids(drives)


@pytest.mark.parametrize("drives", [1, 4, 5, 12])
def test_shared_frames_and_their_twins_have_identifiers_of_no_drive(drives):
    many = wired(node_ids=tuple(range(1, drives + 1)))
    shared = pdo.received_ids(many) - {pdo.command_id(node) for node in many.node_ids}
    assert len(shared) == 2 * -(-drives // 4)
    assert not any(can_id & 0x7F for can_id in shared)
    assert 0x180 not in shared  # reserved by CiA 301


def test_more_drives_than_shared_frames_have_identifiers_for_are_refused():
    many = DRIVES.model_dump() | {"node_ids": tuple(range(1, 14))}
    with pytest.raises(ValueError, match="13 drives, but shared torque frames"):
        CanopenDrivesSection.model_validate(many)


@given(SEVEN, SEVEN)
def test_group_frames_carry_every_torque_in_its_slot(permille, words):
    first, second = pdo.GroupFrames(DRIVES, fd=False).torques(permille, words)
    assert (first.arbitration_id, second.arbitration_id) == (0x200, 0x300)
    assert struct.unpack("<4h", first.data) == tuple(permille[:4])
    assert struct.unpack("<4h", second.data) == (*permille[4:], 0)


@given(SEVEN, st.lists(st.integers(0, 0xFFFF), min_size=7, max_size=7))
def test_drive_frames_carry_controlword_and_torque(permille, words):
    frames = pdo.DriveFrames(DRIVES, fd=False).torques(permille, words)
    assert [f.arbitration_id for f in frames] == [0x201 + k for k in range(7)]
    assert [struct.unpack("<Hh", f.data) for f in frames] == list(zip(words, permille, strict=True))


def test_a_command_is_controlword_and_torque_mode():
    frame = pdo.GroupFrames(DRIVES, fd=False).command(3, 0x0F)
    assert frame is not None
    assert (frame.arbitration_id, bytes(frame.data)) == (0x304, b"\x0f\x00\x0a")
    assert pdo.DriveFrames(DRIVES, fd=False).command(3, 0x0F) is None


@pytest.mark.parametrize("fd", [False, True])
def test_frames_are_of_the_configured_kind(fd):
    for frames in (pdo.GroupFrames(DRIVES, fd), pdo.DriveFrames(DRIVES, fd)):
        kinds = {(f.is_fd, f.bitrate_switch) for f in frames.torques([0] * 7, [0] * 7)}
        assert kinds == {(fd, fd)}
