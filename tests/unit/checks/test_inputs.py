"""Wrong inputs are never green, right ones never refused: the table of both, through `run`."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from chain_arm import Experiment
from right_inputs import RIGHT
from wrong_inputs import flipped, late, loaded, right, scaled, some_in_degrees, turned
from wrong_table import WRONG

from ident.checks.examine import examine
from ident.checks.recorder_faults.lost_samples import repeated_and_skipped
from ident.checks.remark import Grade, RefusedError, Remark, verdict_content
from ident.checks.settings import DEFAULT
from ident.checks.torque import beyond_possible, explained_after_all
from ident.workflows.run import run_data
from wamctl.arm.errors import UserError

DO = (
    "Check Choose Correct Fasten Find Give Identify If Let List Move Reverse Record Set Stamp Warm"
    " Write"
).split()
"""How a sentence begins that says what to do."""


LONG = pytest.mark.thorough
LONG_ONES = ("8 joints", "9 joints", "10 joints", "11 joints")


def judged(log) -> tuple[str, set[str], list[dict]]:
    """The verdict of `run` in memory, with codes and remarks."""
    try:
        arm = log.arm()
        content = run_data(arm, [log.dataset(arm)]).content
    except RefusedError as refusal:
        content = verdict_content(refusal.remarks)
    except UserError as error:
        text = str(error)
        last = re.split("[:.] ", text.rstrip("."))[-1]
        advice = f"{last[0].upper()}{last[1:]}."
        content = {
            "verdict": "refused",
            "remarks": [{"code": "unreadable", "sentence": text, "advice": advice}],
        }
    remarks = content["remarks"]
    return content["verdict"], {r["code"] for r in remarks}, remarks


def test_the_tables_are_long_enough():
    assert len(WRONG) >= 60
    assert len(RIGHT) >= 40
    assert len({name for name, _, _ in WRONG}) == len(WRONG)


def test_a_joint_that_stands_still_but_for_a_flipped_bit_says_nothing_of_the_rate():
    log = right()
    q = log.q.copy()
    q[:, 2] = 0.4 + 1e-4 * np.random.default_rng(0).normal(size=len(q))
    q[600, 2] += 0.1
    _, codes, _ = judged(log.with_(q=q))
    assert {"glitches", "poor_motion"} <= codes
    assert "low_rate" not in codes


@pytest.mark.parametrize(("name", "make", "codes"), WRONG, ids=[w[0] for w in WRONG])
def test_a_wrong_input_is_told(name, make, codes):
    verdict, found, remarks = judged(make())
    assert verdict in ("doubtful", "refused")
    assert found & codes, remarks
    for remark in remarks:
        sentence, advice = remark["sentence"], remark["advice"]
        assert sentence[0].isupper() or sentence.startswith(("log", "arm.urdf"))
        assert sentence.endswith(".")
        if remark["code"] != "cutoff":  # a choice that was made, and no fault
            assert advice.split()[0] in DO, advice
            assert advice[:-1].lower() in sentence.lower()


@pytest.mark.parametrize(
    ("name", "make", "codes"),
    [pytest.param(*r, id=r[0], marks=LONG if r[0] in LONG_ONES else []) for r in RIGHT],
)
def test_a_right_input_is_trusted(name, make, codes):
    verdict, found, remarks = judged(make())
    assert found - {"cutoff"} <= codes, remarks  # at a low rate the choice is told
    assert verdict == ("doubtful" if codes else "trustworthy")


@pytest.mark.parametrize("grade", [Grade.DOUBTFUL, Grade.REFUSED])
def test_a_remark_that_lowers_the_verdict_says_what_to_do(grade):
    with pytest.raises(ValueError, match="without advice"):
        Remark("units", (), "The torque is in another unit.", grade)


@pytest.mark.parametrize("wrong", [(0, 2), (1, 2)])
def test_torques_that_are_reversed_are_named_once(wrong):
    """Most of them reversed looks like all reversed and one of them not."""
    _, _, remarks = judged(turned(*wrong))
    assert [r["joints"] for r in remarks if r["code"] == "sign"] == [[k + 1 for k in wrong]]


def test_mended_torque_gives_the_model_of_the_right_one():
    """Reversed and in N mm: the friction is that of the recording as it should have been."""
    log = right()
    wrong = log.with_(tau=-1000 * log.tau)
    found = []
    for one in (log, wrong):
        arm = one.arm()
        found.append(run_data(arm, [one.dataset(arm)]).model.parameter("fc"))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


def test_only_joints_in_degrees_are_converted():
    _, _, remarks = judged(some_in_degrees(2, 5))
    (told,) = (r for r in remarks if r["code"] == "degrees")
    assert told["joints"] == [3, 4, 5]


def test_positions_in_degrees_give_the_model_in_rad():
    log = right()
    found = []
    for one in (log, log.with_(q=np.rad2deg(log.q))):
        arm = one.arm()
        found.append(run_data(arm, [one.dataset(arm)]).model.parameter("fv"))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


@pytest.mark.parametrize("seed", [3, 4, 15, 22])
def test_flipped_bits_leave_the_model_of_the_right_recording(seed):
    """Single torques within four times their range stay, and cost up to 3 %."""
    found = []
    for log in (right(), flipped(seed)):
        arm = log.arm()
        found.append(run_data(arm, [log.dataset(arm)]).model)
    for kind in ("fc", "fv"):
        np.testing.assert_allclose(found[1].parameter(kind), found[0].parameter(kind), rtol=0.05)


def test_one_factor_is_told_of_the_joints_that_have_it():
    _, _, remarks = judged(scaled([0.58, 0.58, 0.58, 0.58, 1.2], right(joints=5)))
    (told,) = (r["sentence"] for r in remarks if r["code"] == "units")
    assert told.startswith("The torque of joints 1 to 4 (not that of joint 5: 1.2")
    _, _, remarks = judged(scaled(0.58, right(joints=5)))
    (told,) = (r["sentence"] for r in remarks if r["code"] == "units")
    assert told.startswith("The torque of all joints is 0.58")


def test_a_delay_that_is_set_is_no_fault():
    log = late(12)
    arm = log.arm()
    codes = []
    for delay_s in (0.0, -0.12):
        known = arm.with_settings(delay_s=delay_s)
        codes.append({r.code for r in examine(known, [log.dataset(known)]).remarks})
    assert codes == [{"late_torque"}, set()]


CLOSE = DEFAULT.model_copy(update={"gain_apart": 1.2})


@pytest.mark.parametrize("current", [False, True])
def test_a_rotor_that_the_urdf_lacks_is_no_current(current):
    """A light joint, whose rotor looks like a factor of 1.3."""
    log = Experiment(joints=4, seconds=20.0).log()
    smooth = np.hanning(21) / np.hanning(21).sum()
    qdd = np.gradient(np.gradient(np.convolve(log.q[:, 3], smooth, "same"), log.t), log.t)
    qdd[:50], qdd[-50:] = 0.0, 0.0
    tau = log.tau.copy()
    tau[:, 3] += tau[:, 3] if current else 0.3 * qdd
    arm = log.arm()
    remarks = examine(arm, [log.with_(tau=tau).dataset(arm)], CLOSE).remarks
    assert {r.code for r in remarks} == ({"current_not_torque"} if current else set())


def test_torque_too_large_at_some_joints_names_the_likelier_reason_first():
    found = []
    for log in (loaded(3.0, 4), right(joints=4).with_(tau=right(joints=4).tau * [1, 1, 1, 5])):
        arm = log.arm()
        (remark,) = examine(arm, [log.dataset(arm)], CLOSE).remarks
        assert remark.code == "current_not_torque"
        found.append(remark)
    load, currents = found
    assert "times: the URDF lacks a load of about 3 kg at the last link" in load.finding
    assert load.finding.index("lacks a load") < load.finding.index("currents")
    assert load.advice.startswith("Give a URDF with every load.")
    assert "times: these are currents" in currents.finding
    assert currents.advice.startswith("If they are currents")


def test_currents_whose_factors_all_differ_are_told_as_such():
    """An even number of them, of which the middle one is none, and no possible load explains."""
    log = right(joints=4)
    arm = log.arm()
    tau = log.tau * [6.0, 0.4, 0.6, 9.0]
    found = [r for r in examine(arm, [log.with_(tau=tau).dataset(arm)], CLOSE).remarks]
    (remark,) = [r for r in found if r.code == "current_not_torque"]
    assert remark.joints == (1, 2, 3, 4)
    assert "times what the URDF's links require: these are currents" in remark.finding
    assert "lacks a load" not in remark.finding


def test_a_load_of_grams_with_the_moments_of_a_heavy_one_is_none():
    """Even where all that is possible may be told, however little it explains."""
    bounds = CLOSE.model_copy(update={"load_ratio": 1e-6})
    log = right(joints=4)
    factors = log.with_(tau=log.tau * [3.66, 0.71, 2.35, 0.61])
    for one, told in ((loaded(3.0, 4), True), (factors, False)):
        arm = one.arm()
        remarks = examine(arm, [one.dataset(arm)], bounds).remarks
        (finding,) = [r.finding for r in remarks if r.code == "current_not_torque"]
        assert ("lacks a load" in finding) == told


def test_samples_are_not_lost_unseen_where_the_stamps_are_uneven():
    """Steps are longer where periods are; only even stamps hide that a sample is missing."""
    t = np.cumsum(np.random.default_rng(0).choice([0.02, 0.03, 0.03, 0.03, 0.08], size=2000))
    wave = np.sin(t[:, None] * [0.7, 1.1])
    part = SimpleNamespace(start_s=0.0, q=wave, tau=wave)
    for lost, told in ((0, True), (400, False)):
        source = SimpleNamespace(lost=lost, joint_names=(), pieces=list)
        data = SimpleNamespace(samples=len(t), rate_hz=33.0, source=source, moving=[True, True])
        _, skipped = repeated_and_skipped([part], data, DEFAULT)
        assert bool(skipped) == told


@pytest.mark.parametrize(
    ("error", "least", "told"), [(0.206, 0.131, True), (0.163, 0.147, False), (0.024, 0.015, False)]
)
def test_torque_that_no_possible_arm_explains_is_told(error, least, told):
    for other, code in (error, "impossible_torque"), (0.1 * error, "sign"):
        remarks = beyond_possible(error, least, lambda other=other: other, DEFAULT)
        assert [r.code for r in remarks] == [code] * told


def test_reversed_torque_is_told_by_what_an_arm_can_be_where_the_urdf_has_no_masses():
    """And without friction, which tells it else."""
    log = Experiment(joints=3, friction=0.0).log()
    bare = re.sub("<inertial>.*?</inertial>", "", log.urdf, flags=re.DOTALL)
    _, codes, remarks = judged(log.with_(urdf=bare, tau=-log.tau))
    assert "sign" in codes
    assert any("Turn the sign of all torques" in r["sentence"] for r in remarks)
    assert "sign" not in judged(log.with_(urdf=bare))[1]


def test_a_joint_without_torque_in_one_recording_is_asked_for_no_load():
    log = right(joints=4)
    arm = log.arm()
    data = [log.with_(tau=log.tau * [0.4, 4.0, 30.0, 0.0]).dataset(arm), log.dataset(arm, "right")]
    assert "current_not_torque" in [r.code for r in examine(arm, data, CLOSE).remarks]


def test_a_joint_that_is_held_is_no_measure_of_the_others_currents():
    """Its noise may be the largest current of all, and no motion tells its gain."""
    log, rng = right(joints=4), np.random.default_rng(0)
    held = np.array([False, True, True, False])
    tau = log.tau + rng.normal(0, 10.0, log.tau.shape) + held * rng.normal(0, 30.0, log.tau.shape)
    arm = log.arm().with_settings(torque_unit="A")
    data = log.with_(q=np.where(held, log.q[0], log.q), tau=tau).dataset(arm)
    assert "current_not_torque" in [r.code for r in examine(arm, [data]).remarks]


def test_a_recording_without_torque_beside_a_right_one_ends_in_a_sentence():
    log = right(joints=1)
    arm = log.arm()
    pair = [log.dataset(arm), log.with_(tau=0.0 * log.tau).dataset(arm, "without")]
    content = run_data(arm, pair).content
    assert content["verdict"] == "doubtful"
    assert "without" in " ".join(r["sentence"] for r in content["remarks"])


def test_a_fit_at_its_own_cut_off_takes_back_the_doubt_of_a_wider_band_alone():
    def remark(code: str, grade: Grade, *joints: int) -> Remark:
        return Remark(code, joints, "found.", grade, "Do something.")

    whole = remark("large_error", Grade.DOUBTFUL)
    others = (
        remark("large_error", Grade.DOUBTFUL, 3),
        remark("large_error", Grade.REFUSED),
        remark("units", Grade.DOUBTFUL),
    )
    limit = DEFAULT.error_doubtful
    assert explained_after_all((whole, *others), 0.9 * limit, DEFAULT) == others
    assert explained_after_all((whole, *others), 1.1 * limit, DEFAULT) == (whole, *others)
