"""The simulated safety module: what it overhears, when it acts, what it ignores."""

from math import pi, tau

import numpy as np
import pinocchio as pin
import pytest

from sim_bus.can_bus.frame import Frame
from sim_bus.puck.codec import SafetyState, decode
from sim_bus.puck.firmware import safety_ids
from sim_bus.puck.safety_module import (
    CONFIGURATION_GAP_NS,
    HEARTBEAT_NS,
    STILL_TOO_FAST_NS,
    Lamp,
    Press,
    SafetyFacts,
    SafetyModule,
)
from sim_bus.puck.safety_speed import watched_points
from wamctl.arm.config import beside, find_file, load_arm_file
from wamctl.arm.robot import load_robot
from wamctl.puck import frames
from wamctl.puck.pendant import Button, Light, decode_pendant

CYCLE_NS = 2_000_000
IDS = safety_ids(185)
ARM = load_arm_file("wam7-classic.yaml")
MATRIX = np.array(ARM.transmission.motor_from_joint)
IDLE = Frame(0x540, bytes.fromhex("88 00 00 00"))
TORQUE = Frame(0x540, bytes.fromhex("88 00 02 00"))


class Bus:
    """The module, and a time that goes on with every frame."""

    def __init__(self, zeroed=True):
        facts = SafetyFacts(
            10, 185, 185, tuple(range(1, 8)), np.full(7, tau / 4096), np.linalg.inv(MATRIX)
        )
        self.module = SafetyModule(facts, zeroed)
        self.now_ns = 1_000_000_000

    def say(self, can_id, data):
        decoded = decode(Frame(can_id, data))
        assert decoded is not None
        return self.module.receive(decoded, self.now_ns)

    def ask(self, name):
        (answer,) = self.say(0x00A, bytes([IDS[name]]))
        assert answer.can_id == 0x546
        return frames.decode_reply(IDS[name], answer.data)

    def set(self, name, value, gap_ns=CONFIGURATION_GAP_NS):
        self.now_ns += gap_ns
        return self.say(0x00A, frames.encode_set(IDS[name], value))

    def cycle(self, q, torques=(0, 0, 0, 0)):
        """Seven position replies and a torque frame; the frames that follow."""
        self.now_ns += CYCLE_NS
        out = self.module.tick(self.now_ns)
        counts = np.rint(MATRIX @ q / tau * 4096).astype(int)
        for node, count in enumerate(counts, 1):
            out += self.say(0x403 | node << 5, int(count & 0x3FFFFF).to_bytes(3, "big"))
        return out + self.say(0x401, frames.encode_torques(42, torques))

    def press(self, button):
        return self.module.press(button, self.now_ns)

    def move(self, speed_rad_s, cycles=10, joint=0):
        q, out = np.zeros(7), []
        q[1] = pi / 2  # stretched out, 0.9 m from the base axis
        for _ in range(cycles):
            q[joint] += speed_rad_s * CYCLE_NS * 1e-9
            out += self.cycle(q)
        return out


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def active(bus):
    assert bus.press(Press.ACTIVATE) == [TORQUE]
    return bus


def test_barretts_limits_are_the_defaults(bus):
    names = ("TL1", "TL2", "VL1", "VL2", "GRPA", "GRPB", "GRPC")
    assert [bus.ask(n) for n in names] == [4731, 5204, 2048, 4096, 1, 2, 3]


def test_the_pendant_activates_and_the_host_cannot(bus):
    bus.set("MODE", SafetyState.ACTIVE)
    assert bus.ask("MODE") == SafetyState.IDLE
    assert bus.press(Press.ACTIVATE) == [TORQUE]
    assert bus.ask("MODE") == SafetyState.ACTIVE


def test_the_host_may_lower_the_mode(active):
    assert active.set("MODE", SafetyState.IDLE) == [IDLE]
    assert active.ask("MODE") == SafetyState.IDLE


def test_the_host_cannot_lift_an_estop(active):
    active.set("MODE", SafetyState.ESTOP)
    active.set("MODE", SafetyState.IDLE)
    assert active.ask("MODE") == SafetyState.ESTOP


@pytest.mark.parametrize(("units", "state"), [(5203, SafetyState.ACTIVE), (5204, SafetyState.IDLE)])
def test_torque_fault(active, units, state):
    out = active.cycle(np.zeros(7), (0, -units, 0, 0))
    assert active.ask("MODE") == state
    assert out == ([IDLE] if state is SafetyState.IDLE else [])


def test_torque_warning_comes_and_goes(active):
    for units, light in ((4730, Light.SAFE), (4731, Light.WARNING), (0, Light.SAFE)):
        active.cycle(np.zeros(7), (units, 0, 0, 0))
        assert decode_pendant(active.ask("PEN")).lights[Lamp.TORQUE] is light


def test_it_polices_only_what_it_hears(active):
    active.say(0x001, frames.encode_set(42, 8191))
    assert active.ask("MODE") == SafetyState.ACTIVE


@pytest.mark.parametrize(
    ("tip_m_s", "state"), [(0.97, SafetyState.ACTIVE), (1.03, SafetyState.IDLE)]
)
def test_velocity_fault(active, tip_m_s, state):
    active.move(tip_m_s / 0.9)
    assert active.ask("MODE") == state


def test_wrist_speed_is_not_considered(active):
    assert active.move(20.0, joint=4) == []


def test_no_velocity_fault_without_a_zero():
    bus = Bus(zeroed=False)
    bus.press(Press.ACTIVATE)
    assert bus.move(3.0) == []


def test_a_limit_of_zero_means_never(active):
    active.set("VL2", 0)
    assert active.move(3.0) == []


def test_ifault_ignores_so_many_samples(active):
    active.move(0.0, cycles=6)
    active.set("IFAULT", 5)
    jump = np.zeros(7)
    for _ in range(6):
        assert active.cycle(jump) == []
    assert active.ask("IFAULT") == 0
    assert active.cycle(jump + 0.1) == [IDLE]


def test_a_fault_shows_on_the_pendant_until_idle_is_pressed(active):
    active.cycle(np.zeros(7), (6000, 0, 0, 0))
    pendant = decode_pendant(active.ask("PEN"))
    assert pendant.lit(Light.FAULT) == ("torque",)
    assert (pendant.idle_light, pendant.activate_light) == (True, False)
    assert pendant.button is Button.NONE
    assert active.press(Press.ACTIVATE) == []
    active.press(Press.IDLE)
    assert active.press(Press.ACTIVATE) == [TORQUE]


def test_still_too_fast_after_half_a_second_is_an_estop(active):
    active.move(1.5, cycles=int(STILL_TOO_FAST_NS / CYCLE_NS))
    assert active.ask("MODE") == SafetyState.IDLE
    active.move(1.5, cycles=10)
    assert active.ask("MODE") == SafetyState.ESTOP
    assert not active.module.zeroed


def test_slow_enough_after_half_a_second_stays_idle(active):
    active.move(1.5, cycles=20)
    active.move(0.5, cycles=int(STILL_TOO_FAST_NS / CYCLE_NS))
    assert active.ask("MODE") == SafetyState.IDLE
    assert active.module.zeroed


def test_silence_is_a_heartbeat_fault(active):
    active.cycle(np.zeros(7))
    assert active.module.tick(active.now_ns + HEARTBEAT_NS) == []
    assert active.module.tick(active.now_ns + HEARTBEAT_NS + 1) == [IDLE]
    assert decode_pendant(active.ask("PEN")).lit(Light.FAULT) == ("heartbeat",)


def test_configuration_within_ten_milliseconds_is_lost(bus):
    bus.set("TL1", 100)
    bus.set("TL2", 200, gap_ns=CONFIGURATION_GAP_NS - 1)
    bus.set("VL1", 300)
    assert [bus.ask(n) for n in ("TL1", "TL2", "VL1")] == [100, 5204, 300]


def test_defaults_come_back_by_def_and_load(bus):
    bus.set("TL2", 200)
    bus.set("DEF", IDS["TL2"])
    assert bus.ask("TL2") == 200
    bus.set("LOAD", IDS["TL2"])
    assert bus.ask("TL2") == 5204


def test_an_estop_loses_the_zero(active):
    active.press(Press.ESTOP)
    assert active.ask("ZERO") == 0
    active.set("ZERO", 1)
    assert active.ask("ZERO") == 1


def test_watched_points_move_as_the_robots_elbow_and_tool():
    path = find_file("wam7-classic.yaml")
    robot = load_robot(beside(path, ARM.robot.urdf).read_text(), ARM.robot.joints)
    data = robot.data()
    random = np.random.default_rng(5)
    for _ in range(50):
        q, qd = random.uniform(-1, 1, 7), random.uniform(-1, 1, 7)
        pin.forwardKinematics(robot.model, data, q, qd)
        frame = robot.model.getFrameId(ARM.limits.elbow_frame)
        speed = np.linalg.norm(pin.getFrameVelocity(robot.model, data, frame).linear)
        a, b = (np.array(watched_points(q + h * qd)) for h in (-1e-6, 1e-6))
        elbow, beyond = np.linalg.norm(b - a, axis=1) / 2e-6
        assert elbow == pytest.approx(speed, abs=0.05 * np.linalg.norm(qd))
        place = robot.model.getFrameId(ARM.limits.tool_frame)
        tool = np.linalg.norm(pin.getFrameVelocity(robot.model, data, place).linear)
        assert beyond == pytest.approx(tool, abs=0.1 * np.linalg.norm(qd))


def test_a_frame_of_the_hosts_is_no_torque_unless_its_property_is_t(active):
    assert active.cycle(np.zeros(7)) == []
    assert active.say(0x401, frames.encode_torques(43, (8000,) * 4)) == []
