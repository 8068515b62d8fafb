"""The simulated drives against frames that nobody sane would send."""

import numpy as np

from sim_bus.assembly import load_simulation
from sim_bus.can_bus.frame import ERROR, EXTENDED, REMOTE, Frame

INTERESTING = (0x000, 0x080, 0x200, 0x300, 0x203, 0x303, 0x603, 0x604, 0x583, 0x703)
OBJECTS = (0x1005, 0x1014, 0x1017, 0x1400, 0x1600, 0x1800, 0x1A00, 0x2406, 0x6040, 0x6060, 0x6071)


def frame(random):
    """A random frame; one in two is a request to write some object."""
    if random.random() < 0.5:
        index = int(random.choice(OBJECTS)) + int(random.integers(2))
        head = bytes([0x2F | 0x03, index & 0xFF, index >> 8, int(random.integers(4))])
        command = bytes([int(random.choice([0x2F, 0x2B, 0x23, 0x40, 0x21, 0x60]))])
        node = int(random.integers(1, 8))
        return Frame(0x600 + node, command + head[1:] + random.bytes(4))
    can_id = int(random.choice(INTERESTING)) if random.random() < 0.7 else random.integers(0x800)
    flags = int(random.choice([0, 0, 0, 0, ERROR, REMOTE, EXTENDED]))
    return Frame(int(can_id) | flags, random.bytes(int(random.integers(9))))


def test_no_frame_crashes_a_drive_or_makes_more_torque_than_its_limit_allows():
    simulation = load_simulation("wam7.yaml", 0)
    arm, random = simulation.arm, np.random.default_rng(11)
    arm.boot(0)
    answered = 0
    for k in range(20_000):
        now = k * 100_000
        frames = arm.tick(now) + arm.receive(now, frame(random))
        answered += len(frames)
        for answer in frames:
            assert len(answer.data) <= 8
            arm.overhear(now, answer)
        for motor in arm.motors:
            most = motor.objects.values[0x6072, 0]
            assert abs(motor.motor.torque_permille) <= most
            assert motor.is_enabled or motor.motor.torque_permille == 0
    assert answered > 5000
    assert np.all(np.isfinite(arm.plant.q))
