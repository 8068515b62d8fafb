"""Torque that only the leftover of a fit shows to be out of time."""

import pytest

from ident.checks.recorder_faults.delay import late_by_fit
from ident.checks.settings import DEFAULT


@pytest.mark.parametrize(("seconds", "way"), [(-0.1, "lags"), (0.08, "leads")])
def test_filtered_torque_is_told(seconds, way):
    (remark,) = late_by_fit(seconds, 0.008, "log", DEFAULT)
    assert f"{way} the motion by about {abs(seconds):g} s" in remark.finding


@pytest.mark.parametrize(("seconds", "sd"), [(-0.009, 0.0018), (0.08, 0.03), (0.0, 0.0)])
def test_what_a_model_lacks_is_no_delay(seconds, sd):
    assert late_by_fit(seconds, sd, "log", DEFAULT) == []
