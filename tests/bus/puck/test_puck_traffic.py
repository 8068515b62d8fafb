"""What a cycle puts on the bus, against the reference's budget (wam_and_puck.md, section 3.3)."""

from collections import Counter

import pytest

from sim_bus.can_bus.frame_length import GAP_BITS, classic_frame_bits
from tests.bus.buses import on_embedded_bus

POLL, TORQUES = 0x404, (0x401, 0x402)
POSITIONS = tuple(0x423 + 0x20 * k for k in range(7))
UNSTUFFED_US, FULLY_STUFFED_US = 774.0, 930.0
FIRST, CYCLES = 300, 1000


@on_embedded_bus("bus_word")
def test_ten_frames_a_cycle_and_the_load_that_was_derived(experiment):
    frames = experiment().frames
    polls = [k for k, frame in enumerate(frames) if frame.can_id == POLL and len(frame.data) == 1]
    frames = frames[polls[FIRST] : polls[FIRST + CYCLES]]

    heard = Counter(frame.can_id for frame in frames)
    cycle = {POLL, *TORQUES, *POSITIONS}
    assert {can_id: heard[can_id] for can_id in cycle} == dict.fromkeys(cycle, CYCLES)
    beside = len(frames) - 10 * CYCLES
    assert beside == pytest.approx(2 * CYCLES / 20, abs=2)  # questions and their answers

    unstuffed_us = sum(44 + 8 * len(frame.data) + GAP_BITS for frame in frames) / CYCLES
    assert unstuffed_us == pytest.approx(UNSTUFFED_US, rel=0.02)
    on_the_wire_us = sum(classic_frame_bits(frame) + GAP_BITS for frame in frames) / CYCLES
    assert UNSTUFFED_US < on_the_wire_us < FULLY_STUFFED_US
