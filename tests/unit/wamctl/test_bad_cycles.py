"""How long bad answers are borne."""

from dataclasses import replace

import numpy as np
import pytest

from wamctl.drives.interface import Readings
from wamctl.safety.bad_cycles import BadCycleCounter

NAMES = ("drive 1", "drive 2", "drive 3")
GOOD = Readings(np.zeros(3), (), True, False, None)


def noted(bad_cycles, *cycles, periods=1):
    return [bad_cycles.note(readings, periods) for readings in cycles]


@pytest.mark.parametrize(
    ("bad", "cause"),
    [
        ({"missing": (1,)}, "no position from drive 2 in 8 cycles (limit 8)"),
        (
            {"missing": (1,), "late": (0, 1)},
            "positions from drive 1, drive 2 came too late for their cycle in 8 cycles (limit 8)",
        ),
        ({"duplicates": (2,)}, "two positions at once from drive 3 in 8 cycles (limit 8)"),
        (
            {"out_of_order": (2,)},
            "positions from drive 3 came behind those that follow them (safety.answers_in_order) "
            "in 8 cycles (limit 8)",
        ),
    ],
)
def test_eight_bad_cycles_are_the_end(bad, cause):
    bad_cycles = BadCycleCounter(NAMES, 8, in_order=True)
    assert noted(bad_cycles, *[replace(GOOD, **bad)] * 8) == [*[None] * 7, cause]


def test_an_order_that_need_not_be_kept_is_no_fault():
    out_of_order = replace(GOOD, out_of_order=(1,))
    assert set(noted(BadCycleCounter(NAMES, 8, in_order=False), *[out_of_order] * 100)) == {None}


def test_as_many_good_cycles_as_bad_ones_are_borne_for_ever():
    late = replace(GOOD, late=(0,))
    assert set(noted(BadCycleCounter(NAMES, 8, in_order=True), *[late, GOOD] * 1000)) == {None}


def test_more_bad_cycles_than_good_ones_end_it():
    late = replace(GOOD, late=(0,))
    found = noted(BadCycleCounter(NAMES, 8, in_order=True), *[late, late, GOOD] * 10)
    assert next(k for k, cause in enumerate(found) if cause) == 19


def test_a_cycle_that_was_held_up_counts_for_all_its_periods():
    bad_cycles = BadCycleCounter(NAMES, 8, in_order=True)
    missing = replace(GOOD, missing=(0,))
    assert noted(bad_cycles, missing, periods=5) == [None]
    assert noted(bad_cycles, missing, missing) == [None, None]
    assert noted(bad_cycles, missing) == ["no position from drive 1 in 8 cycles (limit 8)"]
