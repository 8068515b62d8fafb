"""Several recordings: what contradicts is told, parameter by parameter, with its meaning."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from chain_arm import Experiment, urdf_of

from ident.checks.settings import DEFAULT
from ident.identification.agreement import Comparison
from ident.identification.torque_delay import Delay
from ident.identification.validation import arm_of, predict
from ident.workflows import agreement
from ident.workflows.run import run_data
from ident.workflows.validate import checked, large_errors, with_signs_of_fit

HALF = 2000
WRONG = np.array([1.0, 1.0, -1.0, 1.0])


def halves(**settings):
    """Two recordings of one arm: the halves of one."""
    log = Experiment(joints=4, seconds=40.0, **settings).log()
    parts = slice(None, HALF), slice(HALF, None)
    return [log.with_(t=log.t[p] - log.t[p][0], q=log.q[p], tau=log.tau[p]) for p in parts]


def run(*logs):
    arm = logs[0].arm()
    data = [log.dataset(arm, f"log_{i}") for i, log in enumerate(logs)]
    return run_data(arm, data).content


def told(content) -> list[str]:
    return [r["sentence"] for r in content["remarks"] if r["code"] == "recordings_disagree"]


def test_recordings_of_one_arm_agree():
    for seed in range(3):
        content = run(*halves(seed=seed))
        assert not told(content)
        assert "recordings_disagree" not in content


def test_a_recording_that_is_given_twice_is_told():
    first, second = halves()
    content = run(first, second, first)
    assert content["verdict"] == "doubtful"
    (remark,) = [r for r in content["remarks"] if r["code"] == "twice"]
    assert remark["sentence"] == (
        "Recording 3, log_2, holds the samples of recording 1: they count twice, and standard"
        " errors are too small. Give each recording once."
    )
    assert "twice" not in [r["code"] for r in run(first, second)["remarks"]]


def test_short_recordings_that_others_predict_do_not_contradict(monkeypatch):
    """Ten parameters fit some samples by themselves without an error; others' own error counts."""
    apart = np.array([1.0, 0.0]), np.full(2, 0.01), np.zeros(2), np.full(2, 0.01)
    evidence: Any = SimpleNamespace(logs=("one", "two"))

    def beside(among_others):
        found = Comparison(*apart, 0.001, 0.025, among_others, "other")
        monkeypatch.setattr(agreement, "compared", lambda _: [found, found])
        return agreement._ratio(found, DEFAULT) > DEFAULT.disagree_ratio

    assert beside(0.002)
    assert not beside(0.02)
    assert agreement.contradictions(evidence) == ([], [])


def test_a_delay_is_said_before_a_contradiction():
    late, unsure = Delay(-0.012, 1e-3), Delay(-0.012, 0.01)
    assert agreement._delayed([late, late, unsure]).startswith("Set delay_s: -0.012 first, since")
    assert "12 ms late" in agreement._delayed([late])
    assert agreement._delayed([late, unsure]) == agreement._delayed([Delay(0.001, 1e-5)]) == ""


def test_warmer_drives():
    first, second = halves()
    third, _ = halves(friction=0.04)
    content = run(first, second, third)
    (sentence,) = told(content)
    assert sentence.startswith("log_2 contradicts the other recordings: ")
    assert "colder or warmer" in sentence
    (row,) = content["recordings_disagree"]
    assert row["change"] == "friction"
    assert {p["name"][:2] for p in row["parameters"]} <= {"fv", "fc"}
    assert all(abs(p["value"]) < abs(p["others"]) for p in row["parameters"])


def test_another_tool():
    masses = 5.0 * 0.7 ** np.arange(4)
    first, second = halves()
    other, _ = halves(true_urdf=urdf_of(4, masses * [1, 1, 1, 1.3]), friction=0.0)
    same, _ = halves(friction=0.0)
    content = run(same, other)
    (row,) = content["recordings_disagree"]
    assert row["change"] == "load"
    assert "tool or payload" in told(content)[0]
    assert not told(run(first, second))


def test_another_tool_in_half_of_the_recordings():
    """Beside the mixed others none of them stands out."""
    masses = 5.0 * 0.7 ** np.arange(4)
    with_tool = halves(true_urdf=urdf_of(4, masses * [1, 1, 1, 1.3]), friction=0.0)
    first, second = halves(friction=0.0)
    content = run(first, with_tool[0], second, with_tool[1])
    rows = content["recordings_disagree"]
    assert {r["name"] for r in rows} in ({"log_0", "log_2"}, {"log_1", "log_3"})
    assert {r["change"] for r in rows} == {"load"}
    (sentence,) = told(content)
    assert " contradict the other recordings: " in sentence
    assert not told(run(first, second, *halves(friction=0.0, seed=1)))


def test_another_mounting():
    tilted = 9.81 * np.array([np.sin(0.1), 0.0, -np.cos(0.1)])
    same, _ = halves(friction=0.0)
    other, _ = halves(friction=0.0, gravity=lambda t: tilted)
    content = run(same, other)
    assert [r["change"] for r in content["recordings_disagree"]] == ["other"]
    assert "mounting" in told(content)[0]


def test_a_model_that_does_not_predict_a_recording_is_doubted():
    first, _ = halves(friction=0.0)
    heavy = 5.0 * 0.7 ** np.arange(4) * [1, 1, 2, 4]
    other, _ = halves(friction=0.0, true_urdf=urdf_of(4, heavy))
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    told = [large_errors([predict(model, arm, log.dataset(arm))], model) for log in (first, other)]
    assert told[0] == []
    assert [r.code for r in told[1]] == ["large_error"]
    assert "of the torque unexplained" in told[1][0].sentence


def test_a_tool_that_the_model_lacks_is_told_where_the_arm_explains_far_more():
    """At an error that would pass for that of a poor model."""
    first, second = halves(friction=0.0)
    masses = 5.0 * 0.7 ** np.arange(4)
    other, _ = halves(friction=0.0, true_urdf=urdf_of(4, masses * [1, 1, 1, 1.3]))
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    assert large_errors([predict(model, arm, second.dataset(arm))], model) == []
    (remark,) = large_errors([predict(model, arm, other.dataset(arm, "other.mcap"))], model)
    assert remark.finding.startswith("other.mcap: the model leaves ")
    assert float(remark.finding.split("leaves ")[1].split(" %")[0]) < 100 * DEFAULT.error_doubtful
    assert "tool, load" in remark.advice


def test_what_the_recording_itself_leaves_is_not_the_models():
    first, second = halves()
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    slow = np.random.default_rng(0).normal(size=second.tau.shape).cumsum(axis=0)
    slow -= np.linspace(0.0, 1.0, len(slow))[:, None] * slow[-1]
    noisy = second.with_(tau=second.tau + second.tau.std(axis=0) * slow / slow.std(axis=0))
    (remark,) = large_errors([predict(model, arm, noisy.dataset(arm))], model)
    assert "a fit of this recording alone leaves" in remark.finding
    assert remark.advice.startswith("Check this recording's torque")


def test_of_several_recordings_each_remark_names_its_own():
    first, second = halves()
    arm = first.arm()
    rough = np.random.default_rng(0).normal(size=second.tau.shape).cumsum(axis=0)
    noisy = second.with_(tau=second.tau + 1.5 * second.tau.std(axis=0) * rough / rough.std(axis=0))
    data = [first.dataset(arm, "first.mcap"), noisy.dataset(arm, "noisy.mcap")]
    _, remarks = checked(arm, data)
    assert remarks
    assert all(r.finding.startswith("noisy.mcap: ") for r in remarks)
    _, alone = checked(arm, data[1:])
    assert [r.sentence for r in remarks] == [f"noisy.mcap: {r.sentence}" for r in alone]


def test_a_light_joint_that_the_model_does_not_predict_is_told():
    first, _ = halves(friction=0.0)
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    other = first.with_(tau=first.tau * [1.0, 1.0, 1.0, -1.0])
    (remark,) = large_errors([predict(model, arm, other.dataset(arm))], model)
    assert (remark.code, remark.joints) == ("large_error", (4,))
    assert "200 % at joint 4" in remark.sentence


def test_a_model_that_explains_nothing_tells_no_signs():
    first, second = halves()
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    tau = np.where([False, True, False, False], -second.tau, 3.0 * second.tau[::-1])
    log = second.with_(tau=tau).dataset(arm, "other.mcap")
    found, told = with_signs_of_fit(model, arm, log, log)
    assert told == []
    assert found.filtered["feasible"].relative_percent > 100.0


def test_the_model_says_which_way_a_torque_counts():
    """One joint reversed in the recording, another by the checks: only the first is told."""
    first, second = halves()
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    upright, reversed_ = second.dataset(arm), second.with_(tau=second.tau * [1, -1, 1, 1])
    usual = predict(model, arm, upright).filtered["feasible"].relative_percent
    found, told = with_signs_of_fit(model, arm, upright.with_torque_times(WRONG), upright)
    assert found.filtered["feasible"].relative_percent == usual
    assert told == []
    log = reversed_.dataset(arm, "other.mcap")
    found, told = with_signs_of_fit(model, arm, log.with_torque_times(WRONG), log)
    assert abs(found.filtered["feasible"].relative_percent - usual) < 1e-9
    (remark,) = told
    assert remark.finding.startswith(
        "other.mcap: the torque of joint 2 has the other sign than the model's, and was inverted"
    )


def test_a_torque_that_tells_no_sign_counts_as_the_others_do():
    """Noise of one sign hides a light joint's torque: the model errs either way."""
    first, second = halves()
    model = run_data(first.arm(), [first.dataset(first.arm())]).model
    arm = arm_of(model)
    added = np.random.default_rng(0).normal(size=len(second.t)).cumsum()[:, None] * [0, 0, 0, 1.0]
    added *= 1.5 * np.abs(second.tau[:, 3]).max() / np.abs(added).max()
    log = second.with_(tau=-(second.tau + added)).dataset(arm, "other.mcap")
    _, (remark,) = with_signs_of_fit(model, arm, log, log)
    assert remark.joints == (1, 2, 3, 4)
