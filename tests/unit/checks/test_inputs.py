"""Wrong inputs are never green, right ones never refused: the table of both, through `run`."""

import numpy as np
import pytest
from right_inputs import RIGHT
from wrong_inputs import right
from wrong_table import WRONG

from ident.checks.remark import RefusedError
from ident.workflows.run import run_data
from wamctl.arm.errors import UserError


def judged(log) -> tuple[str, set[str], list[str]]:
    """The verdict of `run` in memory, with codes and sentences."""
    try:
        arm = log.arm()
        content = run_data(arm, [log.dataset(arm)]).content
    except RefusedError as refusal:
        return "refused", {r.code for r in refusal.remarks}, [r.sentence for r in refusal.remarks]
    except UserError as error:
        return "refused", {"unreadable"}, [str(error)]
    remarks = content["remarks"]
    return content["verdict"], {r["code"] for r in remarks}, [r["sentence"] for r in remarks]


def test_the_tables_are_long_enough():
    assert len(WRONG) >= 60
    assert len(RIGHT) >= 40
    assert len({name for name, _, _ in WRONG}) == len(WRONG)


@pytest.mark.parametrize(("name", "make", "codes"), WRONG, ids=[w[0] for w in WRONG])
def test_a_wrong_input_is_told(name, make, codes):
    verdict, found, sentences = judged(make())
    assert verdict in ("doubtful", "refused")
    assert found & codes, sentences
    for sentence in sentences:
        assert sentence[0].isupper() or sentence.startswith(("log", "joint", "arm.urdf"))
        assert sentence.endswith(".")


@pytest.mark.parametrize(("name", "make", "codes"), RIGHT, ids=[r[0] for r in RIGHT])
def test_a_right_input_is_trusted(name, make, codes):
    verdict, found, sentences = judged(make())
    assert found <= codes, sentences
    assert verdict == ("doubtful" if codes else "trustworthy")


def test_mended_torque_gives_the_model_of_the_right_one():
    """Reversed and in N mm: the friction is that of the recording as it should have been."""
    log = right()
    wrong = log.with_(tau=-1000 * log.tau)
    found = []
    for one in (log, wrong):
        arm = one.arm()
        found.append(run_data(arm, [one.dataset(arm)]).model.parameter("fc"))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


def test_positions_in_degrees_give_the_model_in_rad():
    log = right()
    found = []
    for one in (log, log.with_(q=np.rad2deg(log.q))):
        arm = one.arm()
        found.append(run_data(arm, [one.dataset(arm)]).model.parameter("fv"))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)
