"""The same wrong inputs through `gap`: none passes for trustworthy, and none ends in a bug."""

import pytest
from wrong_inputs import compensated, right
from wrong_table import WRONG

from ident.checks.remark import RefusedError
from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.workflows.gap import gap_of
from wamctl.arm.errors import UserError

SEARCHED = (
    "all torques reversed",
    "N mm",
    "6 % repeated readings",
    "no inertials",
    "negative inertia",
    "friction of joint 3 compensated twice",
    "positions times 0.9",
    "50 N m at joint 4",
    "torque rectified",
    "equal stamps",
)
"""Inputs that are searched all the same, with a remark; the others below are refused."""

REFUSED = (
    "turns", "encoder counts", "position 2 reversed", "position 3 reversed", "N cm", "kgf m",
    "kgf cm", "lbf in", "ahead of gears of 50", "ampere, one gain", "torques 1 and 2 swapped",
    "torques 2 and 3 swapped", "positions 1 and 2 swapped", "joints 2 and 3 swapped",
    "joints 1 and 3 swapped", "torques in reverse order", "half a second", "fifteen samples",
    "one second", "two seconds", "all joints together", "2.5 Hz", "1 Hz",
    "all stamps equal",
    "four short holes", "zero effort", "constant effort", "noise as torque",
    "torque of another recording", "negative mass of link 2",
    "negative mass of link 3", "two arms in turn",
)  # fmt: skip
CHOSEN = [w for w in WRONG if w[0] in SEARCHED + REFUSED]


def searched(log) -> tuple[str, set[str]]:
    """What `gap` makes of a recording: its trust, and the codes of its remarks."""
    try:
        source = of_arm(log.arm(), None, [log.recording()], ["log"])
        content = gap_of(source, Options(null_runs=0), lambda *told: None).content
    except RefusedError as refusal:
        return "refused", {r.code for r in refusal.remarks}
    except UserError:
        return "refused", {"unreadable"}
    return content["trust"], {r["code"] for r in content["remarks"]}


@pytest.mark.parametrize(("name", "make", "codes"), CHOSEN, ids=[w[0] for w in CHOSEN])
def test_a_wrong_input_is_told(name, make, codes):
    trust, found = searched(make())
    assert trust == ("doubtful" if name in SEARCHED else "refused")
    assert found & codes


def test_nothing_is_named_beside_an_arm_that_is_not_possible():
    """The hidden spring is suspected; beside the true friction it is named."""
    wrong, names = compensated(2), []
    spring = 20.0 * (wrong.q - 0.2) * [0.0, 1.0, 0.0]
    for log in (wrong, right()):
        source = of_arm(log.arm(), None, [log.with_(tau=log.tau + spring).recording()], ["log"])
        found = gap_of(source, Options(null_runs=0), lambda *told: None).content
        names.append([{e["name"] for e in found[k]} for k in ("effects", "suspected")])
    assert names[0][0] == set()
    assert "joint_spring" in names[0][1]
    assert "joint_spring" in names[1][0]


def test_the_table_is_long_enough():
    assert len(CHOSEN) == len(SEARCHED) + len(REFUSED) >= 30
