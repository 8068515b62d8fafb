"""Where a torque ends: at the end of its range, or at the last of its coarse steps."""

import numpy as np
import pytest

from ident.checks.recorder_faults.torque_range import _ends
from ident.checks.settings import DEFAULT

COURSE = np.sin(np.linspace(0.0, 40.0, 4000))


def test_a_torque_that_is_cut_off_ends_there() -> None:
    assert _ends([np.clip(COURSE, -0.9, 0.8)], DEFAULT) == [-0.9, 0.8]


@pytest.mark.parametrize("step", [0.005, 0.02])
def test_the_last_of_coarse_steps_is_no_end(step: float) -> None:
    """It is hardly more often there than at the step before."""
    assert _ends([np.round(COURSE / step) * step], DEFAULT) == []


def test_a_torque_in_coarse_steps_is_cut_off_as_well() -> None:
    stepped = np.round(np.clip(COURSE, -0.5, 0.5) / 0.005) * 0.005
    assert _ends([stepped], DEFAULT) == pytest.approx([-0.5, 0.5])


def test_a_torque_that_never_changes_has_no_end() -> None:
    assert _ends([np.zeros(100)], DEFAULT) == []
