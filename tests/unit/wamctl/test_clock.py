"""Absolute deadlines, on a clock that the test turns."""

import time
from itertools import pairwise

import pytest

from wamctl.realtime.clock import LockstepClock, RealTimeClock


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
    clock = RealTimeClock(0.002, stamped=True, overtime=5)
    clock.start()
    clock.tick()
    assert clock.remaining() == pytest.approx(0.0116)
    world.now_ns += 11_000_000  # it came at last
    clock.tick()
    assert clock.skipped == 4
    assert clock.remaining() == pytest.approx(0.0116)
    clock.patient = False
    assert clock.remaining() == pytest.approx(0.0016)


def test_waiting_is_counted_in_periods_and_only_as_long_as_it_may_last(world):
    clock = RealTimeClock(0.002, overtime=4)
    clock.start()
    clock.tick()
    assert clock.waited == 1
    world.now_ns += 3_000_000
    assert clock.waited == 2
    world.now_ns += 50_000_000  # this computer was busy with something else
    assert clock.waited == 5


@pytest.mark.parametrize(("stamped", "ages"), [(True, [-0.001, 0.002]), (False, [0.0, 0.0])])
def test_the_age_of_a_frame_counts_from_its_cycle(world, stamped, ages):
    clock = RealTimeClock(0.002, stamped=stamped)
    clock.start()
    clock.tick()
    started_s = time.time_ns() * 1e-9
    world.now_ns += 9_000_000  # when it is read does not matter
    found = [clock.age(started_s + age_s) for age_s in (-0.001, 0.002)]
    assert found == pytest.approx(ages, abs=1e-6)


def test_in_lockstep_the_bus_says_how_old_a_frame_is():
    class Keeper:
        now_s = 0.5

    assert LockstepClock(0.002, Keeper()).age(0.499) == pytest.approx(-0.001)
    assert LockstepClock(0.002).age(0.499) == 0.0


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
