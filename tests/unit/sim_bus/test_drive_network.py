"""Network management of a drive: boot-up, heartbeat, commands."""

from sim_bus.can_bus.frame import Frame


def test_power_on_is_announced(bench):
    assert bench.frames == [Frame(0x703, b"\0")]


def test_the_heartbeat_shows_the_state(bench):
    bench.write(0x1017, 0, 100, 2)
    assert bench.wait(250) == [Frame(0x703, b"\x7f")] * 2
    bench.send(0, b"\x01\x03")
    assert bench.wait(100) == [Frame(0x703, b"\x05")]
    bench.send(0, b"\x02\x00")
    assert bench.wait(100) == [Frame(0x703, b"\x04")]


def test_no_heartbeat_when_it_is_off(bench):
    bench.write(0x1017, 0, 0, 2)
    assert bench.wait(10_000) == []


def test_a_command_to_another_node_is_ignored(bench):
    bench.write(0x1017, 0, 100, 2)
    for command in (b"\x01\x04", b"\x01", b"\x01\x03\x00", b"\x81\x05"):
        assert bench.send(0, command) == []
    assert bench.wait(100) == [Frame(0x703, b"\x7f")]


def test_no_service_data_in_stopped(bench):
    bench.send(0, b"\x02\x03")
    assert bench.send(0x603, bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0])) == []


def test_leaving_operational_takes_the_torque_away(bench):
    for command in (b"\x80\x00", b"\x02\x00", b"\x81\x00", b"\x82\x00"):
        bench.send(0, b"\x80\x00")
        bench.enable()
        bench.write(0x6071, 0, 100, 2)
        assert bench.drive.motor_torque_nm != 0.0
        bench.send(0, command)
        assert bench.drive.motor_torque_nm == 0.0
        assert not bench.drive.is_enabled


def test_reset_communication_restores_the_communication_objects_only(bench):
    bench.write(0x1017, 0, 100, 2)
    bench.write(0x2406, 0, 20, 2)
    assert bench.send(0, b"\x82\x03") == [Frame(0x703, b"\0")]
    assert bench.read(0x1017) == 2000
    assert bench.read(0x2406) == 20


def test_reset_node_restores_everything_but_what_is_fixed(bench):
    bench.write(0x2406, 0, 20, 2)
    assert bench.send(0, b"\x81\x00") == [Frame(0x703, b"\0")]
    assert bench.read(0x2406) == 0
    assert bench.read(0x6076) == 1490
    assert bench.read(0x1018, 4) == 77


def test_the_identity_is_that_of_the_configuration(bench):
    assert [bench.read(0x1018, k) for k in (1, 2)] == [0x408, 0x4]
