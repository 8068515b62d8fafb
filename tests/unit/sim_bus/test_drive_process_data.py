"""PDOs of a drive: mapping, types, lengths."""

import struct

import pytest

from sim_bus.can_bus.frame import Frame
from sim_bus.canopen.dictionary import Abort
from sim_bus.canopen.drive import CanopenDrive, DriveSettings

TORQUE, DUMMY, CONTROLWORD, MODE = 0x60710010, 0x00030010, 0x60400010, 0x60600008


def group(third):
    return struct.pack("<4h", 111, 222, third, 444)


def test_the_standard_order_of_mapping_is_accepted(bench):
    assert bench.map_pdo(0x1400, 0x200, [DUMMY, TORQUE], 1) == [None] * 7


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x60770010, Abort.NOT_MAPPABLE),
        (0x60760020, Abort.NOT_MAPPABLE),
        (0x60640020, Abort.NOT_MAPPABLE),
        (0x60710020, Abort.NOT_MAPPABLE),
        (0x00030008, Abort.NOT_MAPPABLE),
        (0x00010001, Abort.NOT_MAPPABLE),
    ],
)
def test_what_cannot_be_mapped_is_refused_at_the_number_of_entries(bench, entry, code):
    answers = bench.map_pdo(0x1400, 0x200, [entry], 1)
    assert answers[:4] == [None, None, None, code]


def test_a_transmit_pdo_takes_no_dummies(bench):
    assert bench.map_pdo(0x1800, 0x183, [DUMMY], 1)[3] == Abort.NOT_MAPPABLE


def test_more_than_eight_bytes_are_refused(bench):
    answers = bench.map_pdo(0x1400, 0x200, [TORQUE] * 5, 1)
    assert answers[7] == Abort.PDO_TOO_LONG


def test_a_valid_pdo_cannot_be_remapped(bench):
    assert bench.write(0x1600, 0, 0, 1) == Abort.DEVICE_STATE
    assert bench.write(0x1400, 1, 0x204, 4) == Abort.VALUE_RANGE
    assert bench.write(0x1400, 1, 0x80000204, 4) is None
    assert bench.write(0x1600, 1, TORQUE, 4) == Abort.UNSUPPORTED_ACCESS


@pytest.mark.parametrize("cob_id", [0x000, 0x080, 0x180, 0x583, 0x603, 0x6E0, 0x703, 0x800])
def test_a_reserved_identifier_is_refused(bench, cob_id):
    bench.write(0x1400, 1, 0x80000203, 4)
    assert bench.write(0x1400, 1, cob_id, 4) == Abort.VALUE_RANGE


@pytest.mark.parametrize(("kind", "code"), [(240, None), (241, Abort.VALUE_RANGE), (254, None)])
def test_transmission_types(bench, kind, code):
    assert bench.write(0x1402, 2, kind, 1) == code


def test_maps_are_writable_in_pre_operational_only(bench):
    bench.enable()
    assert bench.write(0x1400, 1, 0x80000200, 4) == Abort.DEVICE_STATE
    assert bench.write(0x1600, 1, TORQUE, 4) == Abort.DEVICE_STATE


def test_a_type_1_torque_waits_for_sync(bench):
    bench.enable()
    assert bench.send(0x200, group(500)) == []
    assert bench.drive.motor_torque_nm == 0.0
    bench.send(0x080)
    assert bench.drive.motor_torque_nm == pytest.approx(0.5 * 1.49)


def test_a_type_1_torque_is_applied_once(bench):
    bench.enable()
    bench.send(0x200, group(500))
    bench.send(0x080)
    bench.write(0x6071, 0, 100, 2)
    bench.send(0x080)
    assert bench.drive.motor_torque_nm == pytest.approx(0.1 * 1.49)


def test_a_type_255_pdo_acts_at_once(bench):
    bench.map_pdo(0x1401, 0x303, [CONTROLWORD, MODE], 255)
    bench.send(0, b"\x01\x00")
    bench.send(0x303, struct.pack("<Hb", 0x06, 10))
    assert bench.statusword & 0x6F == 0x21
    assert bench.read(0x6061) == 10


def test_a_transmit_pdo_of_type_1_answers_each_sync(bench):
    bench.enable()
    bench.encoder = (-123456, 7)
    expected = Frame(0x183, struct.pack("<Hi", 0x1237, -123456))
    assert bench.send(0x080) == [expected]
    assert bench.send(0x080) == [expected]


def test_a_transmit_pdo_of_type_3_answers_every_third_sync(bench):
    bench.write(0x1801, 1, 0xC0000283, 4)
    bench.map_pdo(0x1800, 0x40000183, [0x60640020], 3)
    bench.send(0, b"\x01\x00")
    assert [len(bench.send(0x080)) for _ in range(7)] == [0, 0, 1, 0, 0, 1, 0]


def test_a_transmit_pdo_of_type_255_follows_its_event_timer(bench):
    bench.write(0x1802, 5, 10, 2)
    bench.map_pdo(0x1802, 0x40000383, [0x606C0020], 255)
    bench.send(0, b"\x01\x00")
    bench.encoder = (0, 4096)
    frames = [f for f in bench.wait(35) if f.can_id == 0x383]
    assert frames == [Frame(0x383, struct.pack("<i", 4096))] * 3


def test_no_pdo_outside_operational(bench):
    assert bench.send(0x080) == []
    bench.enable()
    bench.send(0, b"\x80\x00")
    assert bench.send(0x080) == []
    assert bench.send(0x200, group(500)) == []


def test_a_short_pdo_is_not_processed_and_reported_once(bench):
    bench.enable()
    (emergency,) = bench.send(0x200, bytes(7))
    assert emergency == Frame(0x083, struct.pack("<HB5x", 0x8210, 0x11))
    assert bench.send(0x200, bytes(7)) == []
    bench.send(0x080)
    assert bench.drive.motor_torque_nm == 0.0
    assert bench.read(0x1003, 1) == 0x8210
    assert bench.send(0x200, group(0)) == [Frame(0x083, bytes(8))]
    assert bench.read(0x1001) == 0


def test_a_long_pdo_is_processed_and_reported(bench):
    bench.map_pdo(0x1400, 0x200, [DUMMY, TORQUE], 255)
    bench.write(0x6060, 0, 10, 1)
    bench.send(0, b"\x01\x00")
    for word in (0x06, 0x0F):
        bench.write(0x6040, 0, word, 2)
    (emergency,) = bench.send(0x200, struct.pack("<4h", 1, 300, 2, 3))
    assert emergency.data[:2] == b"\x20\x82"
    assert bench.drive.motor_torque_nm == pytest.approx(0.3 * 1.49)


def test_the_default_pdo_of_type_0_disables_the_drive_at_every_sync_until_it_is_sent(bench):
    bench.send(0, b"\x01\x00")
    bench.write(0x6060, 0, 10, 1)
    for word in (0x06, 0x07, 0x0F):
        bench.write(0x6040, 0, word, 2)
    assert bench.statusword & 0x6F == 0x27
    bench.send(0x080)
    assert bench.statusword & 0x4F == 0x40
    assert bench.read(0x6061) == 0

    for word in (0x06, 0x07, 0x0F):
        bench.send(0x203, struct.pack("<Hbh", word, 10, 40))
        bench.send(0x080)
    for _ in range(3):
        bench.send(0x080)
        assert bench.statusword & 0x6F == 0x27
        assert bench.drive.motor_torque_nm == pytest.approx(0.04 * 1.49)


def test_the_default_transmit_pdos_answer_every_sync(bench):
    bench.send(0, b"\x01\x00")
    assert [(f.can_id, len(f.data)) for f in bench.send(0x080)] == [(0x183, 7), (0x283, 6)]


def test_a_drive_on_can_fd_takes_longer_pdos_and_fills_its_own_up(description):
    settings = DriveSettings(3, 1490, 77, fd=True)
    drive = CanopenDrive(description, settings, lambda: 7, lambda: 8)

    def send(can_id, data):
        return drive.receive(0, Frame(can_id, data, True))

    def write(index, subindex, value, size):
        data = value.to_bytes(size, "little").ljust(4, b"\0")
        send(0x603, struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex) + data)

    for parameter, cob_id, entries in (
        (0x1400, 0x200, [DUMMY] * 2 + [TORQUE] + [DUMMY] * 4),
        (0x1800, 0x40000183, [0x60410010, 0x60640020, 0x606C0020]),
    ):
        write(parameter, 1, cob_id | 0x80000000, 4)
        write(parameter + 0x200, 0, 0, 1)
        for k, entry in enumerate(entries, 1):
            write(parameter + 0x200, k, entry, 4)
        write(parameter + 0x200, 0, len(entries), 1)
        write(parameter, 2, 1, 1)
        write(parameter, 1, cob_id, 4)
    write(0x1801, 1, 0xC0000283, 4)
    write(0x6060, 0, 10, 1)
    send(0, b"\x01\x00")
    for word in (0x06, 0x0F):
        write(0x6040, 0, word, 2)
    assert send(0x200, struct.pack("<7h2x", 0, 0, 250, 0, 0, 0, 0)) == []  # 14 bytes, carried as 16
    (answer,) = send(0x080, b"")
    assert answer == Frame(0x183, struct.pack("<Hii2x", 0x1237, 7, 8), True)
    assert drive.motor_torque_nm == pytest.approx(0.25 * 1.49)
