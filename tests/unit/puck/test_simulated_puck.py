"""The simulated motor Puck against the protocol's description, byte by byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bus.can_bus.frame import Frame
from sim_bus.puck.codec import Mode, Stat, decode
from sim_bus.puck.drive import BOOT_NS, BUS_OFF, HAZARD_NS, PuckDrive, PuckFacts
from sim_bus.puck.firmware import MONITOR, motor_ids, safety_ids
from wamctl.puck import frames
from wamctl.puck.properties import motor_properties, safety_properties


class Bench:
    """A Puck on a bench, whose encoders show what they are told to."""

    def __init__(self, node=1, version=185, joint=None):
        self.motor, self.joint = 0, joint
        joint_encoder = None if joint is None else lambda: self.joint
        facts = PuckFacts(node, version, 12, 4096, 2700)
        self.puck = PuckDrive(facts, lambda: self.motor, joint_encoder)
        self.now_ns = 0

    def tell(self, can_id, data):
        """The only answer to a frame; None for none, or where the Puck does not listen."""
        frame = Frame(can_id, bytes.fromhex(data) if isinstance(data, str) else data)
        if can_id not in self.puck.handlers:
            return None
        answers = self.puck.receive(self.now_ns, frame)
        return answers[0] if answers else None

    def ask(self, name):
        number = motor_ids(self.puck.facts.version)[name]
        answer = self.tell(self.puck.facts.node, frames.encode_get(number))
        return frames.decode_reply(number, answer.data)

    def set(self, name, value):
        number = motor_ids(self.puck.facts.version)[name]
        assert self.tell(self.puck.facts.node, frames.encode_set(number, value)) is None

    def wait(self, duration_ns):
        self.now_ns += duration_ns
        self.puck.tick(self.now_ns)


def in_torque_mode(node=1):
    bench = Bench(node)
    bench.tell(0x400, "88 00 02 00")
    return bench


@pytest.mark.parametrize("version", range(32, 200))
def test_its_property_ids_are_those_that_the_host_uses(version):
    assert motor_properties(version).ids().items() <= motor_ids(version).items()
    assert safety_properties(version).ids().items() <= safety_ids(version).items()


def test_the_monitor_answers_eleven_properties():
    names = "VERS ROLE SN ID ERROR STAT ADDR VALUE LOCK SAVE LOAD".split()
    assert dict(zip(names, range(11), strict=True)) == MONITOR


def test_answers_go_to_group_six_with_the_set_bit():
    assert Bench(3).tell(0x003, "05") == Frame(0x466, bytes.fromhex("85 00 02 00"))


def test_wide_answers_have_six_bytes():
    answer = Bench().tell(0x001, frames.encode_get(68))
    assert answer == Frame(0x426, bytes.fromhex("C4 00 00 10 00 00"))


def test_position_goes_to_group_three():
    bench = Bench(7)
    bench.motor = 4096
    assert bench.tell(0x404, "30") is None  # GRPC is still 5, as in the 2008 manual
    assert bench.tell(0x007, "30") == Frame(0x4E3, bytes.fromhex("00 10 00"))


def test_position_with_a_joint_encoder_has_six_bytes():
    bench = Bench(joint=789199)
    bench.motor = -4096
    answer = bench.tell(0x404, "30")
    assert frames.decode_positions(answer.data) == (-4096, 789199)
    assert bench.ask("ROLE") == 0x4100


def test_another_group_and_another_node_are_not_answered():
    assert Bench(1).tell(0x002, "05") is None
    assert Bench(1).tell(0x405, "30") is None


def test_the_groups_can_be_set():
    bench = Bench(7)
    bench.set("GRPC", 4)
    assert bench.tell(0x404, "30") is not None
    assert bench.tell(0x405, "30") is None


@pytest.mark.parametrize(("node", "group", "place"), [(1, 1, 0), (4, 1, 3), (5, 2, 0), (7, 2, 2)])
def test_a_packed_torque_reaches_its_place_only(node, group, place):
    bench = in_torque_mode(node)
    torques = [10, -20, 30, -40]
    bench.tell(0x400 | 3 - group, frames.encode_torques(42, torques))
    assert bench.puck.torque_units == 0
    bench.tell(0x400 | group, frames.encode_torques(42, torques))
    assert bench.puck.torque_units == torques[place]


@given(st.lists(st.integers(-8191, 8191), min_size=4, max_size=4))
def test_packed_torques_of_the_host_are_understood(torques):
    decoded = decode(Frame(0x401, frames.encode_torques(42, torques)))
    assert decoded is not None
    assert decoded.torques == tuple(torques)


@given(st.integers(-(2**21), 2**21 - 1))
def test_positions_are_understood_by_host_and_safety_module(counts):
    bench = Bench()
    bench.set("P", counts)
    answer = bench.tell(0x404, "30")
    decoded = decode(answer)
    assert decoded is not None
    assert frames.decode_positions(answer.data) == (counts,) == (decoded.position,)


@given(st.integers(-(2**15), 2**15 - 1))
def test_answers_are_understood_by_the_host(value):
    bench = Bench()
    bench.set("MT", value)
    assert bench.ask("MT") == value


def test_idle_brakes_and_ignores_torque():
    bench = Bench()
    bench.tell(0x401, frames.encode_torques(42, [100] * 4))
    assert bench.puck.torque_units == 0
    assert not bench.puck.is_enabled


def test_leaving_torque_mode_takes_the_torque_away():
    bench = in_torque_mode()
    bench.tell(0x401, frames.encode_torques(42, [100] * 4))
    assert bench.puck.motor_torque_nm == pytest.approx(100 / 2700)
    assert bench.puck.is_enabled
    bench.tell(0x540, "88 00 00 00")
    assert (bench.puck.mode, bench.puck.torque_units) == (Mode.IDLE, 0)
    assert not bench.puck.is_enabled


def test_torque_is_limited_by_mt():
    bench = in_torque_mode()
    bench.set("MT", 50)
    bench.tell(0x401, frames.encode_torques(42, [-8000] * 4))
    assert bench.puck.torque_units == -50


def test_older_firmware_has_other_ids():
    bench = Bench(version=40)
    bench.motor = -1
    assert bench.tell(0x001, "1a") == Frame(0x423, bytes.fromhex("3F FF FF"))


def test_the_rotor_angle_does_not_follow_the_position():
    bench = Bench()
    bench.set("P", 5)
    bench.motor = -1024
    assert bench.ask("MECH") == 3072


def test_power_off_loses_the_position_and_runs_the_monitor():
    bench = Bench()
    bench.motor = 3000
    bench.puck.switch_off()
    assert bench.tell(0x001, "05") is None
    bench.puck.switch_on()
    assert bench.puck.stat is Stat.RESET
    assert bench.tell(0x001, "30") is None
    assert bench.tell(0x001, "05") == Frame(0x426, bytes.fromhex("85 00 00 00"))
    assert bench.tell(0x001, "00") == Frame(0x426, bytes.fromhex("80 00 B9 00"))


def asleep():
    bench = Bench()
    bench.motor = 3000
    bench.puck.switch_off()
    bench.puck.switch_on()
    return bench


def test_waking_takes_a_silent_second():
    bench = asleep()
    bench.tell(0x400, "85 00 02 00")
    bench.wait(BOOT_NS - 1)
    assert bench.puck.stat is Stat.RESET
    bench.wait(1)
    assert bench.tell(0x001, "05") == Frame(0x426, bytes.fromhex("85 00 02 00"))
    assert bench.tell(0x001, "30") == Frame(0x423, bytes(3))
    assert BOOT_NS < 1_000_000_000


def test_traffic_while_it_comes_online_drives_the_bus_off():
    bench = asleep()
    bench.tell(0x400, "85 00 02 00")
    assert bench.tell(0x002, "85 00 02 00") is None
    bench.wait(BOOT_NS - HAZARD_NS + 1)
    assert bench.tell(0x002, "05") == BUS_OFF


def test_saved_values_survive_and_others_do_not():
    bench = Bench()
    bench.set("MT", 111)
    bench.set("SAVE", motor_ids(185)["MT"])
    bench.set("OTEMP", 20)
    bench.puck.switch_off()
    bench.puck.switch_on()
    bench.tell(0x001, "85 00 02 00")
    bench.wait(BOOT_NS)
    assert (bench.ask("MT"), bench.ask("OTEMP")) == (111, 60)


@given(st.integers(0, 0x7FF), st.binary(min_size=0, max_size=8))
def test_no_frame_breaks_it_or_gives_torque_in_idle(can_id, data):
    bench = Bench()
    bench.tell(can_id, data)
    if bench.puck.mode is Mode.IDLE:
        assert bench.puck.torque_units == 0
