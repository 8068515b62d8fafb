"""The plan of the bus against the reference's budget of a native cycle."""

import pytest

from wamctl.arm.config import PuckDrivesSection, load_arm_file
from wamctl.puck.bus_load import plan

ARM = load_arm_file("wam7-classic.yaml")


def load(joint_encoders):
    assert isinstance(ARM.drives, PuckDrivesSection)
    counts = (1,) * joint_encoders + (0,) * (7 - joint_encoders)
    return plan(ARM.bus, ARM.drives.model_copy(update={"joint_encoder_counts": counts}))


@pytest.mark.parametrize(
    ("joint_encoders", "worst_us", "nominal", "worst"),
    [(0, 930, 0.387, 0.465), (4, 1050, 0.435, 0.525)],
)
def test_the_cycle_is_as_long_as_derived(joint_encoders, worst_us, nominal, worst):
    planned = load(joint_encoders)
    assert planned.cycle_us == pytest.approx(worst_us, abs=1e-9)
    assert planned.nominal == pytest.approx(nominal, rel=0.02)
    assert planned.worst == pytest.approx(worst, rel=0.02)


def test_ten_frames_a_cycle_and_now_and_then_a_question():
    rates = [t.per_second for t in load(0).traffic]
    assert sum(rates) == pytest.approx(5000 + 50)
    assert load(0).answer_us == 55 + 7 * 71
