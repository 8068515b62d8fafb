"""Faults of the simulated bus, one by one, on an arm without a bus."""

import struct

import pytest
import yaml

from sim_bus.can_bus.frame import Frame
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.faults.faulty_arm import HOST_IS_BUS_OFF
from wamctl.arm.errors import ConfigurationError

SYNC = Frame(0x080)
PERIOD_NS = 2_000_000
HEARTBEATS = range(0x700, 0x780)


class Run:
    """A faulty arm that is brought to OPERATION ENABLED, and then cycles with a torque."""

    def __init__(self, path, *faults, seed=0, **more):
        path.write_text(yaml.safe_dump({"faults": list(faults), **more}))
        self.said = []
        self.simulation, self.arm = load_faulty_simulation(
            "wam7.yaml", seed, path, self.said.append
        )
        self.now = 0
        self.booted = self.arm.boot(0)

    def write(self, node, index, subindex, value, size):
        data = value.to_bytes(size, "little").ljust(4, b"\0")
        head = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex)
        return self.arm.receive(self.now, Frame(0x600 + node, head + data))

    def enable(self):
        for node in range(1, 8):
            self.write(node, 0x1801, 1, 0xC0000280 + node, 4)
            self.write(node, 0x1400, 1, 0x80000200 + node, 4)
            self.write(node, 0x1600, 0, 0, 1)
            for slot in range(4):
                mapped = 0x60710010 if slot == (node - 1) % 4 else 0x00030010
                self.write(node, 0x1600, slot + 1, mapped, 4)
            self.write(node, 0x1600, 0, 4, 1)
            self.write(node, 0x1400, 2, 1, 1)
            self.write(node, 0x1400, 1, 0x200 if node < 5 else 0x300, 4)
            self.write(node, 0x6060, 0, 10, 1)
        self.arm.receive(self.now, Frame(0, b"\x01\x00"))
        for word in (0x06, 0x07, 0x0F):
            for node in range(1, 8):
                self.write(node, 0x6040, 0, word, 2)
        return self

    def cycle(self, permille=100):
        """One cycle: what the arm sends, heartbeats left out."""
        self.now += PERIOD_NS
        frames = self.arm.tick(self.now) + self.arm.receive(self.now, SYNC)
        for frame in frames:
            frames += self.arm.overhear(self.now, frame)
        torques = struct.pack("<4h", *[permille] * 4)
        for group in (0x200, 0x300):
            frames += self.arm.receive(self.now, Frame(group, torques))
        return [f for f in frames if f.can_id not in HEARTBEATS]

    def torque(self, node):
        motor = self.simulation.arm.motors[node - 1]
        return motor.motor_torque_nm

    def state(self, node):
        return self.simulation.arm.motors[node - 1].motor.state


def ids(frames):
    return [f.can_id for f in frames]


def answers(frames, node):
    """Statusword, position of a node's TPDO1."""
    return [
        struct.unpack_from("<H", f.data) + struct.unpack_from("<i", f.data, 3)
        for f in frames
        if f.can_id == 0x180 + node
    ]


TPDOS = [0x181, 0x182, 0x183, 0x184, 0x185, 0x186, 0x187]


@pytest.fixture
def run(tmp_path):
    return lambda *faults, **more: Run(tmp_path / "faults.yaml", *faults, **more)


def test_without_faults_all_is_well(run):
    bench = run().enable()
    assert [ids(bench.cycle()) for _ in range(3)] == [TPDOS] * 3
    assert bench.said == []


def test_a_drive_fault_comes_in_its_cycle_and_takes_the_torque(run):
    bench = run({"fault": "drive_fault", "node": 3, "after": "enabled", "cycles": 5}).enable()
    for _ in range(4):
        assert ids(bench.cycle()) == TPDOS
    assert bench.torque(3) != 0.0
    frames = bench.cycle()
    assert frames[0] == Frame(0x083, struct.pack("<HB5x", 0x2310, 0x03))
    assert answers(frames, 3)[0][0] & 0x4F == 0x08
    assert bench.torque(3) == 0.0
    assert bench.torque(2) != 0.0
    assert bench.said == [
        "drive_fault begins at 0.010000 s, cycle 5: "
        '{"after":"enabled","cycles":5,"fault":"drive_fault","node":3,"code":8976}'
    ]


def test_an_emergency_alone_changes_nothing(run):
    bench = run({"fault": "emergency", "node": 2, "code": 0x4210, "seconds": 0.004}).enable()
    bench.cycle()
    assert ids(bench.cycle()) == [0x082, *TPDOS]
    bench.cycle()
    assert bench.torque(2) != 0.0


def test_an_under_voltage_cannot_be_reset_before_it_is_over(run):
    fault = {"fault": "under_voltage", "node": 1, "after": "enabled", "for_cycles": 3}
    bench = run(fault).enable()
    frames = bench.cycle()
    assert frames[0].data[:2] == b"\x20\x32"
    for word in (0x00, 0x80):
        bench.write(1, 0x6040, 0, word, 2)
    assert bench.state(1) == 0x08
    for _ in range(3):
        bench.cycle()
    for word in (0x00, 0x80):
        bench.write(1, 0x6040, 0, word, 2)
    assert bench.state(1) == 0x40


def test_a_silent_drive_still_obeys(run):
    fault = {"fault": "silent_drive", "node": 4, "after": "enabled", "cycles": 2, "for_cycles": 2}
    bench = run(fault).enable()
    seen = [0x184 in ids(bench.cycle(permille)) for permille in (10, 20, 30, 40, 50)]
    assert seen == [True, False, False, True, True]
    assert bench.torque(4) == pytest.approx(0.04 * 1.49)


def test_a_dead_drive_makes_no_torque_and_boots_again(run):
    fault = {"fault": "dead_drive", "node": 4, "after": "enabled", "cycles": 2, "for_cycles": 2}
    bench = run(fault).enable()
    bench.cycle()
    assert 0x184 not in ids(bench.cycle())
    assert bench.torque(4) == 0.0
    bench.cycle()
    bench.now += PERIOD_NS
    frames = bench.arm.receive(bench.now, SYNC)
    assert Frame(0x704, b"\0") in frames
    assert 0x184 not in ids(frames)


def test_a_drive_off_the_bus_hears_nothing_and_its_watchdog_acts(run):
    fault = {"fault": "bus_off", "node": 4, "after": "enabled", "cycles": 2, "for_cycles": 20}
    bench = run(fault).enable()
    bench.write(4, 0x2406, 0, 20, 2)
    bench.cycle(10)
    assert all(0x184 not in ids(bench.cycle(20)) for _ in range(20))
    assert bench.state(4) == 0x08
    assert bench.torque(4) == 0.0
    codes = [f.data[:2] for f in bench.cycle() if f.can_id == 0x084]
    assert codes == [b"\x40\x81"]


def test_a_host_off_the_bus_is_told_and_hears_nothing_more(run):
    fault = {"fault": "bus_off", "node": "host", "after": "enabled", "cycles": 2, "for_cycles": 2}
    bench = run(fault).enable()
    assert [bench.cycle() for _ in range(4)][1:3] == [[HOST_IS_BUS_OFF], []]
    assert ids(bench.cycle()) == TPDOS


def test_an_encoder_jumps_and_stays_shifted(run):
    fault = {"fault": "encoder_jump", "node": 5, "counts": 777, "after": "enabled", "cycles": 2}
    still, jumping = run().enable(), run(fault).enable()
    shifts = []
    for _ in range(4):
        pair = [answers(bench.cycle(), 5)[0][1] for bench in (still, jumping)]
        shifts.append(pair[1] - pair[0])
    assert shifts == [0, 777, 777, 777]


def test_an_encoder_sticks_while_the_arm_moves(run):
    fault = {"fault": "stuck_encoder", "node": 2, "after": "enabled", "cycles": 20, "for_cycles": 5}
    bench = run(fault).enable()
    seen = [answers(bench.cycle(), 2)[0][1] for _ in range(30)]
    assert len(set(seen[18:24])) == 1
    assert len(set(seen[24:])) == 6


def test_torque_that_is_not_applied_stays_unnoticed_by_the_drive(run):
    fault = {"fault": "torque_not_applied", "node": 1, "share": 0.0, "after": "enabled"}
    healthy, weak = run().enable(), run(fault).enable()
    for _ in range(100):
        frames = [bench.cycle(900) for bench in (healthy, weak)]
    moved = [answers(f, 1)[0][1] for f in frames]
    assert moved[0] - moved[1] > 1000
    assert weak.torque(1) == healthy.torque(1)


def test_a_drive_answers_under_a_wrong_node_id(run):
    bench = run({"fault": "wrong_node", "node": 3, "becomes": 9})
    assert ids(bench.booted) == [0x701, 0x702, 0x704, 0x705, 0x706, 0x707, 0x709]
    assert bench.write(3, 0x1017, 0, 0, 2) == []


def test_a_drive_shows_a_wrong_identity_even_after_a_reset(run):
    bench = run({"fault": "wrong_identity", "node": 3, "vendor": 0x99})
    bench.arm.receive(0, Frame(0, b"\x81\x00"))
    (answer,) = bench.arm.receive(0, Frame(0x603, b"\x40\x18\x10\x01\0\0\0\0"))
    assert answer.data[4:] == b"\x99\0\0\0"


def frame_fault(kind, can_id, **more):
    return {"fault": kind, "id": can_id, "after": "enabled", "cycles": 2, **more}


def test_lost_positions(run):
    bench = run(frame_fault("lost_frames", 0x183, number=2)).enable()
    assert [0x183 in ids(bench.cycle()) for _ in range(5)] == [True, False, False, True, True]


def test_lost_torques_leave_the_torque_before(run):
    bench = run(frame_fault("lost_frames", 0x200)).enable()
    seen = []
    for permille in (10, 20, 30, 40):
        bench.cycle(permille)
        seen.append(round(bench.torque(1) / 1.49e-3))
    assert seen == [0, 10, 10, 30]


def test_a_lost_sync_gets_no_answers(run):
    bench = run(frame_fault("lost_frames", 0x080)).enable()
    assert [len(bench.cycle()) for _ in range(4)] == [7, 0, 7, 7]


def test_late_positions_come_with_the_next_cycle(run):
    bench = run(frame_fault("late_frames", 0x183, late_ms=1.5)).enable()
    assert [ids(bench.cycle()).count(0x183) for _ in range(4)] == [1, 0, 2, 1]


def test_late_torques_act_one_cycle_later(run):
    bench = run(frame_fault("late_frames", 0x200, late_ms=1.5)).enable()
    seen = []
    for permille in (10, 20, 30, 40):
        bench.cycle(permille)
        seen.append(round(bench.torque(1) / 1.49e-3))
    assert seen == [0, 10, 20, 30]


def test_doubled_positions(run):
    bench = run(frame_fault("doubled_frames", 0x183)).enable()
    assert [ids(bench.cycle()).count(0x183) for _ in range(3)] == [1, 2, 1]


def test_a_reordered_position_comes_after_a_later_one(run):
    bench = run(frame_fault("reordered_frames", 0x183)).enable()
    bench.cycle()
    order = ids(bench.cycle())
    assert sorted(order) == TPDOS
    assert order.index(0x183) > order.index(0x184)


def test_corrupted_positions_have_one_wrong_bit(run):
    healthy = run().enable()
    bench = run(frame_fault("corrupted_frames", 0x183)).enable()
    pairs = [(healthy.cycle()[2], bench.cycle()[2]) for _ in range(3)]
    wrong = [
        sum((a ^ b).bit_count() for a, b in zip(x.data, y.data, strict=True)) for x, y in pairs
    ]
    assert wrong == [0, 1, 0]


def test_cut_torques_are_complained_about(run):
    bench = run(frame_fault("corrupted_frames", 0x200, length=5)).enable()
    bench.cycle()
    emergencies = [f for f in bench.cycle() if f.can_id < 0x100]
    assert [f.data[:2] for f in emergencies] == [b"\x10\x82"] * 4


def test_faults_by_chance_depend_on_the_seed_alone(tmp_path):
    chance = {"number": 6, "to_cycle": 40}

    def said(seed):
        bench = Run(tmp_path / "f.yaml", seed=seed, random=chance).enable()
        for _ in range(50):
            bench.cycle()
        return bench.said

    assert said(4) == said(4)
    assert said(4) != said(5)
    assert len(said(4)) == 6


def test_all_mistakes_of_a_fault_file_are_told_at_once(tmp_path):
    path = tmp_path / "faults.yaml"
    path.write_text(
        "faults:\n"
        "  - {fault: drive_fault, node: 3, cycles: 1, seconds: 2}\n"
        "  - {fault: late_frames, id: 0x183}\n"
        "  - {fault: silent_drive, node: 3, for_ever: true}\n"
        "random: {to_cycle: 3, from_cycle: 5}\n"
    )
    with pytest.raises(ConfigurationError) as caught:
        load_faulty_simulation("wam7.yaml", 0, path, print)
    assert str(caught.value) == (
        f"{path}: 4 faults:\n"
        "  - faults.0.drive_fault: give cycles or seconds, not both\n"
        "  - faults.1.late_frames.late_ms: missing\n"
        "  - faults.2.silent_drive.for_ever: unknown key\n"
        "  - random: to_cycle 3 is before from_cycle 5"
    )


def test_a_fault_of_an_unknown_node_is_refused(tmp_path):
    path = tmp_path / "faults.yaml"
    path.write_text("faults: [{fault: silent_drive, node: 12}]\n")
    with pytest.raises(ConfigurationError) as caught:
        load_faulty_simulation("wam7.yaml", 0, path, print)
    assert str(caught.value) == (
        f"{path}: faults.0.node: no drive has node id 12; the drives are 1, 2, 3, 4, 5, 6, 7."
    )
