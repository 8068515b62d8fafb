"""Torque that was recorded more rarely than positions, and held; and what only looks like it."""

import numpy as np
import pytest
from chain_arm import Experiment, Log

from ident.checks.examine import examine
from ident.checks.recorder_faults.held_torque import _rows_each

LOG = Experiment().log()
ROWS = np.arange(len(LOG.t))
COURSE = np.sin(LOG.t[:, None] * [0.7, 1.1])


def told_of(log: Log) -> list[str]:
    arm = log.arm()
    remarks = examine(arm, [log.dataset(arm)]).remarks
    return [r.finding for r in remarks if "torque was recorded at" in r.finding]


def test_torque_that_is_held_for_five_rows_is_told_with_its_rate() -> None:
    (told,) = told_of(LOG.with_(tau=LOG.tau[ROWS // 5 * 5]))
    assert "stands in about 5 rows" in told
    assert "recorded at about 20 Hz and held, positions at 100 Hz" in told


@pytest.mark.parametrize("rows", [1.7, 2.0, 3.0, 10.0])
def test_torque_need_not_be_held_for_a_whole_number_of_rows(rows: float) -> None:
    held = (np.floor(ROWS / rows) * rows).astype(int)
    assert _rows_each(LOG.tau[held]) == pytest.approx(rows, rel=0.02)


@pytest.mark.parametrize("step", [0.03, 0.1, 0.3])
def test_torque_in_coarse_steps_is_not_held(step: float) -> None:
    """It stays for a while as well, but each joint's changes at rows of its own."""
    assert _rows_each(np.round(COURSE / step) * step) is None


def test_an_arm_that_stands_still_for_a_while_holds_no_torque() -> None:
    still = np.clip(ROWS, None, 400) + np.clip(ROWS - 1000, 0, None)
    assert _rows_each(LOG.tau[still]) is None


def test_right_torque_is_not_told() -> None:
    assert told_of(LOG) == []
