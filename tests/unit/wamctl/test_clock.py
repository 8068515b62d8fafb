"""Absolute deadlines, on a clock that the test turns."""

import time
from itertools import pairwise

import pytest

from wamctl.runtime.clock import LockstepClock, RealTimeClock


class FakeTime:
    """Time that passes only when someone sleeps, or when the test says so."""

    def __init__(self, monkeypatch):
        self.now_ns = 5_000_000_000
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.now_ns)
        monkeypatch.setattr(time, "time_ns", lambda: self.now_ns + 10**18)
        monkeypatch.setattr(time, "sleep", self.sleep)

    def sleep(self, seconds):
        self.now_ns += round(seconds * 1e9) + 30_000  # woken 30 us late


@pytest.fixture
def world(monkeypatch):
    return FakeTime(monkeypatch)


def test_late_wake_ups_do_not_add_up(world):
    clock = RealTimeClock(0.002)
    clock.start()
    stamps = [clock.tick() for _ in range(1000)]
    assert stamps[-1] - stamps[0] == 999 * 2_000_000
    assert clock.latency_ns == 30_000
    assert clock.skipped == 0


def test_an_overrun_is_skipped_and_counted_and_not_made_up_for(world):
    clock = RealTimeClock(0.002)
    clock.start()
    clock.tick()
    world.now_ns += 7_000_000
    late = clock.tick()
    assert clock.skipped == 2
    following = [clock.tick() for _ in range(3)]
    steps = [b - a for a, b in pairwise([late, *following])]
    assert steps[0] < 2_000_000  # back on the grid at once
    assert steps[1:] == [2_000_000, 2_000_000]
    assert clock.skipped == 0


def test_frames_are_awaited_for_most_of_the_period(world):
    clock = RealTimeClock(0.002)
    clock.start()
    clock.tick()
    assert clock.remaining() == pytest.approx(0.0016)
    world.now_ns += 1_000_000
    assert clock.remaining() == pytest.approx(0.0006)
    assert clock.elapsed_ns() == 1_000_000


def test_a_late_frame_holds_a_cycle_up_unless_one_was_missing_before(world):
    clock = RealTimeClock(0.002, overtime=5)
    clock.start()
    clock.tick()
    assert clock.remaining() == pytest.approx(0.0116)
    world.now_ns += 11_000_000  # it came at last
    clock.tick()
    assert clock.skipped == 4
    assert clock.remaining() == pytest.approx(0.0116)
    clock.patient = False
    assert clock.remaining() == pytest.approx(0.0016)


def test_lockstep_stamps_are_the_same_every_time(world):
    first, second = LockstepClock(0.002), LockstepClock(0.002)
    for clock in (first, second):
        clock.start()
    stamps = [first.tick() for _ in range(3)]
    world.now_ns += 77
    assert [second.tick() for _ in range(3)] == stamps
    assert stamps[1] - stamps[0] == 2_000_000


def test_lockstep_is_patient_with_the_first_frame_only(world):
    clock = LockstepClock(0.002)
    clock.start()
    clock.tick()
    assert [clock.remaining() for _ in range(3)] == [5.0, 1.0, 1.0]
    clock.patient = False
    clock.tick()
    assert [clock.remaining() for _ in range(3)] == [0.1, 0.1, 0.1]
