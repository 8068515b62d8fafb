import pytest

from sim_bus.can_bus.arbitration import Arbitration
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.frame_length import BitTiming, frame_ns

TIMING = BitTiming(1e6, 5e6)
FOREVER_NS = 10**12


def taken(wire, until_ns=FOREVER_NS):
    arrivals = []
    while (arrival := wire.take(until_ns)) is not None:
        arrivals.append(arrival)
    return arrivals


def test_a_frame_arrives_with_its_last_bit():
    wire = Arbitration(TIMING)
    sync = Frame(0x80)
    wire.offer(5000, sync, "master")
    end = 5000 + frame_ns(sync, TIMING)
    assert wire.take(4999) is None
    assert wire.next_ns() == 5000
    assert wire.take(end - 1) is None
    assert wire.next_ns() == end
    arrival = wire.take(end)
    assert (arrival.time_ns, arrival.frame, arrival.sender) == (end, sync, "master")
    assert wire.next_ns() is None


def test_the_lowest_waiting_identifier_goes_first():
    wire = Arbitration(TIMING)
    for node in (3, 1, 2):
        wire.offer(0, Frame(0x180 + node, bytes(6)), node)
    assert [a.sender for a in taken(wire)] == [1, 2, 3]


def test_a_frame_under_way_is_not_interrupted():
    wire = Arbitration(TIMING)
    wire.offer(0, Frame(0x700, bytes(8)), "late")
    wire.offer(1000, Frame(0x080), "urgent")
    assert [a.sender for a in taken(wire)] == ["late", "urgent"]


def test_frames_of_one_identifier_keep_their_order():
    wire = Arbitration(TIMING)
    for k in range(4):
        wire.offer(0, Frame(0x100, bytes([k])), k)
    assert [a.sender for a in taken(wire)] == [0, 1, 2, 3]


def test_three_bits_lie_between_two_frames():
    wire = Arbitration(TIMING)
    first, second = Frame(0x100, b"\x11"), Frame(0x101, b"\x22")
    wire.offer(0, first, None)
    wire.offer(0, second, None)
    ends = [a.time_ns for a in taken(wire)]
    assert ends[1] == ends[0] + 3000 + frame_ns(second, TIMING)
    assert wire.load.frames == 2
    assert wire.load.peak == pytest.approx((ends[1] + 3000) * 1e-9)


def test_an_answer_waits_for_its_own_time():
    wire = Arbitration(TIMING)
    wire.offer(1_000_000, Frame(0x001), "future")
    wire.offer(0, Frame(0x700), "now")
    assert [a.sender for a in taken(wire, 500_000)] == ["now"]
    assert wire.next_ns() == 1_000_000


def test_the_ten_frames_of_a_cycle_take_as_long_as_the_budget_says():
    wire = Arbitration(TIMING)
    wire.offer(0, Frame(0x080), None)
    for node in range(1, 8):
        wire.offer(0, Frame(0x180 + node, b"\x37\x12\x55\xaa\x01\x00"), None)
    for group in (0x200, 0x300):
        wire.offer(0, Frame(group, b"\x5a" * 8), None)
    taken(wire)
    assert 934e-6 <= wire.load.peak <= 1130e-6


def test_the_load_is_that_of_the_busiest_second():
    wire = Arbitration(TIMING)
    for start_ns in (0, 1_100_000_000, 1_200_000_000, 2_100_000_000):
        wire.offer(start_ns, Frame(0x555, b"\x55" * 8), None)
    taken(wire)
    frame = 1e-9 * frame_ns(Frame(0x555, b"\x55" * 8), TIMING) + 3e-6
    assert wire.load.peak == pytest.approx(2 * frame)


def test_frames_without_a_pause_between_them_end_together():
    wire = Arbitration(TIMING)
    frames = [Frame(0x423 + 32 * k, bytes([k, 0, 77])) for k in range(7)]
    for k, frame in enumerate(frames):
        wire.offer(50_000 + 1000 * k, frame, None)
    wire.offer(2_000_000, Frame(0x001), "behind a pause")
    end = 50_000 + sum(frame_ns(frame, TIMING) for frame in frames) + 6 * 3000
    assert wire.pause_ns() == end
    assert wire.take(51_000) is None  # the first is under way
    assert wire.pause_ns() == end
    assert [a.time_ns for a in taken(wire, end)][-1] == end
    assert wire.pause_ns() == 2_000_000 + frame_ns(Frame(0x001), TIMING)
