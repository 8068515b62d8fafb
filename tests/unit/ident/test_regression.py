"""Reduction of rows, culling, delay, and the estimators, on motions with a known truth."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_arm import motion, recording

import ident.estimation.regression_data
from ident.estimation.least_squares import ESTIMATORS, wanted_estimators
from ident.estimation.regression_data import RegressionData, held_out, noise, reduce_recordings
from ident.identification.cross_validation import check_held_out
from ident.identification.identifiability import confusions, identifiability
from ident.identification.torque_delay import delay
from ident.identification.velocity_threshold import automatic, sweep
from ident.recordings.dataset import dataset
from ident.recordings.errors import TooShortError
from ident.regression.reduction import BLOCKS
from ident.regression.triangles import (
    condition_number,
    least_squares,
    merged,
    squared_error,
    squared_torque,
    triangle,
)
from wamctl.arm.errors import DataError
from wamctl.arm.recording import ReferenceSeries


@pytest.fixture(scope="module")
def evidence(wam, noisy) -> RegressionData:
    return reduce_recordings([dataset(noisy, wam.arm.robot.joint_names, "log")], wam.arm)


def test_triangles_hold_all_that_least_squares_asks():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(90, 6))
    rows[:, 2] = 0.0
    rows[:, 2] += np.where(np.arange(90) < 40, 0.0, rng.normal(size=90))
    parts = np.stack([triangle(rows[:40]), triangle(rows[40:43]), triangle(rows[43:])])
    whole = merged(parts)
    np.testing.assert_allclose(whole.T @ whole, rows.T @ rows, atol=1e-10)
    beta, residual, *_ = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)
    np.testing.assert_allclose(least_squares(whole), beta)
    assert squared_error(whole, beta) == pytest.approx(residual[0])
    assert squared_error(parts, beta).sum() == pytest.approx(residual[0])
    assert squared_torque(parts).sum() == pytest.approx(rows[:, -1] @ rows[:, -1])
    assert condition_number(whole) == pytest.approx(np.linalg.cond(rows[:, :-1]))


def test_a_column_without_effect_is_refused():
    rows = np.ones((20, 3)) * np.array([1.0, 0.0, 2.0])
    with pytest.raises(np.linalg.LinAlgError, match="have no effect in these rows"):
        least_squares(triangle(rows))


def test_stretches_and_excerpt_hold_the_same_rows(evidence):
    reduction = evidence.logs[0].reduction
    assert reduction.count.shape == (BLOCKS, 7)
    rows = np.concatenate(reduction.excerpt.rows())
    assert len(rows) == reduction.count.sum()
    R = merged(evidence.triangles)
    np.testing.assert_allclose(R.T @ R, rows.T @ rows, rtol=1e-8, atol=1e-6)
    assert reduction.culled.sum() == (~reduction.excerpt.kept).sum()


def test_leaving_stretches_out_adds_up(evidence):
    parts = [evidence.only(held_out(fold)) for fold in range(3)]
    assert sum(p.counts.sum() for p in parts) == evidence.counts.sum()
    gram = sum(p.problem().R.T @ p.problem().R for p in parts)
    R = evidence.problem().R
    np.testing.assert_allclose(gram, R.T @ R, rtol=1e-7, atol=1e-5)


def test_all_estimators_find_the_arm(wam, noisy):
    t, q, qd, qdd = motion(20.0, 250.0)
    stamps = np.round(t * 1e9).astype(np.int64)
    log = replace(noisy, reference=ReferenceSeries(stamps, q, qd, qdd))
    more = ["irls", "iv", "feasible_wls", "feasible_cad", "feasible_entropic"]
    arm = wam.arm.with_settings(estimators=more)
    evidence = reduce_recordings([dataset(log, arm.robot.joint_names, "log")], arm)
    true = evidence.base.K @ wam.delta
    R = evidence.problem().R
    best = squared_error(R, true)
    for name in wanted_estimators(evidence):
        if name == "cad":
            continue
        beta = ESTIMATORS[name](evidence).beta
        assert squared_error(R, beta) < 1.05 * best, name
        assert beta[evidence.base.names.index("fc1")] == pytest.approx(wam.fc[0], rel=0.05), name
    note = ESTIMATORS["iv"](evidence).note
    assert note.startswith("OLS shows no bias by noise in the position: |z| = ")


def test_instruments_need_a_reference(wam, noisy):
    arm = wam.arm.with_settings(estimators=["iv"])
    with pytest.raises(DataError) as caught:
        reduce_recordings([dataset(noisy, arm.robot.joint_names, "log")], arm)
    assert str(caught.value) == (
        "log holds no reference motion (/joint_reference), which iv needs: leave iv out."
    )


@pytest.mark.parametrize(("cutoff", "words"), [(2.5, "shows no bias"), (10.0, "is biased")])
def test_instruments_tell_whether_the_filter_was_good_enough(wam, cutoff, words):
    """A millirad of noise: the paper's cut-off takes it out, one that is far too wide does not."""
    t, q, qd, qdd = motion(20.0, 250.0)
    rng = np.random.default_rng(1)
    stamps = np.round(t * 1e9).astype(np.int64)
    log = recording(
        wam.arm.robot.joint_names,
        t,
        q + 1e-3 * rng.normal(size=q.shape),
        wam.torque(q, qd, qdd),
        reference=ReferenceSeries(stamps, q, qd, qdd),
    )
    arm = wam.arm.with_settings(
        estimators=["iv"], cutoff_hz=cutoff, differentiation_cutoff_hz=60, reversals="culled"
    )
    evidence = reduce_recordings([dataset(log, arm.robot.joint_names, "log")], arm)
    assert ESTIMATORS["iv"](evidence).note.startswith(f"OLS {words} by noise in the position")
    W = evidence.problem().R[:-1, :-1]
    true = evidence.base.K @ wam.delta
    wrong = {n: np.linalg.norm(W @ (ESTIMATORS[n](evidence).beta - true)) for n in ("iv", "ols")}
    assert wrong["iv"] < (0.5 if words == "is biased" else 2.0) * wrong["ols"]


def test_outliers_do_not_pull_the_robust_fit(wam, clean):
    effort = clean.effort.copy()
    effort[2000:2100] += 40.0
    log = replace(clean, effort=effort)
    evidence = reduce_recordings([dataset(log, wam.arm.robot.joint_names, "log")], wam.arm)
    true = evidence.base.K @ wam.delta
    place = evidence.base.names.index("fc1")
    robust, plain = (ESTIMATORS[n](evidence).beta[place] - true[place] for n in ("irls", "ols"))
    assert abs(robust) < 0.2 * abs(plain)


def test_held_out_errors_come_from_parameters_that_did_not_see_them(evidence):
    tested = check_held_out(evidence, ["ols", "feasible"])
    fitted = noise(evidence, ESTIMATORS["ols"](evidence).beta)[0]
    assert (tested["ols"].errors.rms_by_joint > fitted).all()
    assert tested["feasible"].errors.mse < tested["ols"].errors.mse
    assert 0 < tested["ols"].sd_percent < tested["ols"].errors.relative_percent
    excerpt = evidence.logs[0].reduction.excerpt
    rest = (excerpt.tau - tested["ols"].predicted[0])[excerpt.kept]
    assert np.mean(rest**2) == pytest.approx(tested["ols"].errors.mse, rel=1e-6)


@pytest.mark.parametrize("late_s", [0.0, 0.004])
def test_a_delay_of_the_torque_is_found(wam, late_s):
    t, q, qd, qdd = motion(20.0, 250.0)
    tau = wam.torque(q, qd, qdd)
    command = np.column_stack([np.interp(t + late_s, t, column) for column in tau.T])
    log = recording(wam.arm.robot.joint_names, t, q, command)
    evidence = reduce_recordings([dataset(log, wam.arm.robot.joint_names, "log")], wam.arm)
    found = delay(evidence.logs[0])
    assert found.seconds == pytest.approx(late_s, abs=2e-4)
    assert 0 < found.sd < 1e-3


def test_culling_helps_where_slow_samples_are_wrong_and_nowhere_else(wam, clean, noisy):
    def swept(log):
        evidence = reduce_recordings([dataset(log, wam.arm.robot.joint_names, "log")], wam.arm)
        return sweep([evidence.logs[0].reduction.excerpt_at_once])

    _, _, qd, _ = motion(20.0, 250.0)
    sticking = clean.effort - wam.fc * np.sign(qd) + wam.fc * np.clip(qd / 0.05, -1, 1)
    stuck = swept(replace(clean, effort=sticking))
    at = list(stuck.thresholds).index(0.05)
    assert stuck.slow.mse[at] < 0.75 * stuck.slow.mse[0]
    assert stuck.random.mse[at] > 0.95 * stuck.slow.mse[0]
    assert stuck.other.mse[at] > 0.95 * stuck.slow.mse[0]
    assert 0.002 < stuck.choice <= 0.1
    fine = swept(noisy)
    assert fine.slow.mse[at] > 0.9 * fine.slow.mse[0]
    assert stuck.removed[0] == 0.0


def test_the_automatic_threshold_keeps_the_condition(evidence):
    curve = sweep([evidence.logs[0].reduction.excerpt]).slow
    steep = replace(curve, mse=np.linspace(2, 1, 12), condition=np.linspace(10, 20, 12))
    flat = replace(curve, mse=np.full(12, 2.0), condition=np.full(12, 10.0))
    thresholds = np.linspace(0, 0.11, 12)
    assert automatic(thresholds, steep, flat) == 0.0
    assert automatic(thresholds, replace(steep, condition=flat.condition), flat) == pytest.approx(
        0.06
    )


def test_what_cannot_be_told_is_named(evidence):
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(100, 4))
    rows[:, 1] = rows[:, 0] + 1e-3 * rng.normal(size=100)
    (found,) = confusions(triangle(rows), ["a", "b", "c"])
    assert found == ("a", "b")
    beta, sd = ESTIMATORS["ols"](evidence).beta, np.full(57, 1e-9)
    sd[evidence.base.names.index("L7xy")] = 1.0
    limits = identifiability(evidence.base, evidence.problem().R, beta, sd)
    assert limits.invisible == ("L7xy",)
    assert {"m1", "L1xx", "m2"} <= set(limits.without_effect)
    assert "fv1" not in limits.only_combined
    assert "m7" in limits.only_combined


def test_recordings_reduce_alike_in_several_processes(wam, noisy, monkeypatch):
    data = [dataset(noisy, wam.arm.robot.joint_names, name) for name in ("first", "second")]
    alone = reduce_recordings(data, wam.arm)
    monkeypatch.setattr(ident.estimation.regression_data, "_WORTH_PROCESSES", 0)
    together = reduce_recordings(data, wam.arm)
    assert [log.data.name for log in together.logs] == ["first", "second"]
    np.testing.assert_array_equal(together.triangles, alone.triangles)
    short = replace(
        noisy, stamp_ns=noisy.stamp_ns[:400], q=noisy.q[:400], effort=noisy.effort[:400]
    )
    with pytest.raises(
        TooShortError,
        match=r"stretch of short lasts 1\.6 s, but a filter with a cut-off of 2",
    ):
        reduce_recordings([data[0], dataset(short, wam.arm.robot.joint_names, "short")], wam.arm)
