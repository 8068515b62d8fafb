"""The mathematics below the fleet's result."""

from dataclasses import replace

import numpy as np
import pytest

from ident.fleet.candidates import Candidate
from ident.fleet.changes import Detector, changes, evidence, lasting, least_log_odds
from ident.fleet.columns import Columns
from ident.fleet.normal import Information, without_scatter
from ident.fleet.reduce import joint_triangles, process_of
from ident.fleet.settings import DEFAULT
from ident.fleet.triangles import of_rows, packed, unpacked
from ident.recordings.loading import Reading, read_logs
from ident.regression.triangles import least_squares, triangle


def test_triangles_come_back_from_bytes_as_they_were():
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((30, 7))
    rows[:, [1, 4]] = 0.0
    one = of_rows(3, triangle(rows))
    ((back,), columns) = unpacked(packed([one], 7))
    assert columns == 7
    assert back.joint == 3
    assert back.used.tolist() == [0, 2, 3, 5, 6]
    assert np.array_equal(back.R, one.R)
    moments = np.zeros((7, 7))
    moments[np.ix_(back.used, back.used)] = back.R.T @ back.R
    np.testing.assert_allclose(moments, rows.T @ rows, atol=1e-12)


def test_triangles_combined_over_logs_are_the_fit_of_all_rows_at_once(logs):
    paths = sorted((logs / "arm0").glob("*.mcap"))[:4]
    arm, data = read_logs(paths, None, Reading())
    arm = arm.with_settings(cutoff_hz=4.0)
    columns = Columns(arm, DEFAULT.stribeck_speeds_rad_s)
    reduced = [joint_triangles(d, columns, process_of(arm, d, columns), DEFAULT)[0] for d in data]
    kept = [*list(range(len(columns.base.kept))), columns.count]
    blobs = [packed([of_rows(j, R) for j, R in r.items()], columns.count + 1) for r in reduced]
    parts = [t for blob in blobs for t in unpacked(blob)[0]]
    wide = []
    for t in parts:
        rows = np.zeros((len(t.used), columns.count + 1))
        rows[:, t.used] = t.R
        wide.append(rows[:, kept])
    combined = least_squares(triangle(np.concatenate(wide)))
    rows = _all_rows(arm, data, columns)[:, kept]
    scale = np.linalg.norm(rows[:, :-1], axis=0)
    at_once = np.linalg.lstsq(rows[:, :-1] / scale, rows[:, -1], rcond=None)[0] / scale
    np.testing.assert_allclose(combined, at_once, rtol=1e-9, atol=1e-9)


def _all_rows(arm, data, columns):
    """Every row of every log, never reduced."""
    from ident.regression.rows import Regressor, rows_of

    found = []
    for d in data:
        process = process_of(arm, d, columns)
        regressor = Regressor(arm.robot, arm.terms, columns.base, d.moving, columns.further)
        for rows in rows_of(d, process, regressor):
            for j in range(2):
                kept = np.abs(rows.speed[:, j]) >= process.threshold_rad_s
                parts = rows.W[kept, j], rows.curves[kept, j], rows.tau[kept, j]
                found.append(columns.wide(j, *parts))
    return np.concatenate(found)


def test_scatter_of_days_integrated_out_is_that_of_the_whole_covariance():
    rng = np.random.default_rng(1)
    X, tau = rng.standard_normal((40, 5)), rng.standard_normal(40)
    places, Q = [1, 3], np.array([0.3, 0.7])
    covariance = np.eye(40) + X[:, places] @ np.diag(Q) @ X[:, places].T
    inverse = np.linalg.inv(covariance)
    said = without_scatter(Information(X.T @ X, X.T @ tau), places, Q)
    np.testing.assert_allclose(said.N, X.T @ inverse @ X, atol=1e-9)
    np.testing.assert_allclose(said.y, X.T @ inverse @ tau, atol=1e-9)


P, ONE = 4, np.ones(1)
CANDIDATES = [
    Candidate(
        "parameter", (k + 1,), (f"x{k}",), ("N m",), np.eye(P)[:, [k]], ONE, ONE, f"x{k}"
    )
    for k in range(P)
]  # fmt: skip
SETTINGS = replace(DEFAULT, least_logs=2, onsets=30)


def _arm(rng, days, onset=None, size=0.0):
    x = rng.standard_normal(P)
    logs = []
    for day in range(days):
        now = x + (size * np.eye(P)[2] if onset is not None and day >= onset else 0.0)
        X = rng.standard_normal((6, P))
        logs.append(Information(X.T @ X, X.T @ (X @ now + rng.standard_normal(6))))
    return logs


def _detector(found, onsets=30):
    return Detector(np.zeros(P), np.ones(P), found, onsets, 2)


def test_the_smallest_change_that_logs_show_is_the_one_that_is_just_told():
    """Logs without noise, and a candidate that they say nothing of."""
    rng = np.random.default_rng(4)
    X = rng.standard_normal((20, 6, P)) * [1.0, 1.0, 0.3, 0.0]
    before = [Information(x.T @ x, np.zeros(P)) for x in X]
    tested = _detector(CANDIDATES)
    evidence(before, tested)
    smallest = tested.smallest(7, 5.0)
    assert smallest[3] > 1e6
    for k in range(3):
        d = smallest[k] * np.eye(P)[k]
        after = [Information(log.N, log.N @ d) for log in before[-7:]]
        told = _detector(CANDIDATES)
        evidence([*before[:-7], *after], told)
        odds = told.odds()
        assert odds.single[13 - odds.first, k] == pytest.approx(5.0, abs=1e-9)
    assert np.isnan(_detector(CANDIDATES).smallest(7, 5.0)).all()


@pytest.mark.thorough
def test_odds_without_a_change_seldom_exceed_what_they_may():
    """A test martingale exceeds 20 ever in at most one case of 20."""
    rng = np.random.default_rng(2)
    above = 0
    for _ in range(400):
        odds = evidence(_arm(rng, 25), _detector(CANDIDATES))
        above += odds.max() > np.log(20.0)
    assert above <= 32  # 20 expected at most; 32 is 2.8 standard deviations above


def test_odds_are_those_of_the_marginal_likelihoods():
    """The closed form beside the densities of all the data under both hypotheses."""
    rng = np.random.default_rng(3)
    X = rng.standard_normal((3, 5, P))
    tau = rng.standard_normal((3, 5))
    logs = [Information(x.T @ x, x.T @ t) for x, t in zip(X, tau, strict=True)]
    odds = evidence(logs, _detector(CANDIDATES[:1], onsets=1))[-1] + np.log(2.0)
    rows, torque = X.reshape(-1, P), tau.ravel()
    null = np.eye(15) + rows @ rows.T
    change = np.concatenate([np.zeros(10), X[2, :, 0]])
    other = null + np.outer(change, change)

    def density(C):
        return -0.5 * (torque @ np.linalg.solve(C, torque) + np.linalg.slogdet(C)[1])

    assert odds == pytest.approx(density(other) - density(null), abs=1e-9)


def test_a_change_is_named_with_its_size_and_onset_and_a_second_one_too():
    rng = np.random.default_rng(4)
    logs = _arm(rng, 30, onset=12, size=3.0)
    later = np.eye(P)[0] * -4.0
    logs = [
        Information(log.N, log.y + log.N @ later) if day >= 22 else log
        for day, log in enumerate(logs)
    ]
    told = changes(logs, np.zeros(P), np.ones(P), CANDIDATES, np.log(100.0), SETTINGS)
    assert [c.parameter for c in told] == ["x2", "x0"]
    assert [c.onset for c in told] == [12, 22]
    assert abs(told[0].size - 3.0) < 4 * told[0].sd
    assert abs(told[1].size + 4.0) < 4 * told[1].sd


def test_what_the_next_days_take_back_is_no_change():
    """One odd day, and the arm as it was before; the same day as the last one is told."""
    logs = _arm(np.random.default_rng(6), 20)
    odd = Information(logs[12].N, logs[12].y + logs[12].N @ (np.eye(P)[1] * 5.0))
    logs[12] = odd
    asked = np.log(100.0)
    odds = evidence(logs, _detector(CANDIDATES))
    assert odds.max() > asked > lasting(odds, SETTINGS.naming_logs)
    start = np.zeros(P), np.ones(P), CANDIDATES, asked, SETTINGS
    assert changes(logs, *start) == []
    assert lasting(odds[:13], SETTINGS.naming_logs) > asked
    assert [c.parameter for c in changes(logs[:13], *start)] == ["x1"]


def test_the_size_of_a_turned_zero_is_as_unsure_as_its_linear_term():
    """Torque that is taken as linear in an angle is off by half of its square."""
    logs = _arm(np.random.default_rng(4), 16, onset=12, size=3.0)
    found = [
        changes(logs, np.zeros(P), np.ones(P), [one], np.log(100.0), SETTINGS)[0]
        for one in (CANDIDATES[2], replace(CANDIDATES[2], left_out=0.5))
    ]
    assert found[0].size == found[1].size
    assert found[1].sd == pytest.approx(np.hypot(found[0].sd, found[0].size ** 2 / 2))


def test_more_arms_ask_for_more_and_more_changes_for_less():
    quiet = [-1.0] * 98
    assert least_log_odds([*quiet, 1.0, 2.0], 0.05) == pytest.approx(np.log(100 / 0.05))
    assert least_log_odds([*quiet, 50.0, 50.0], 0.05) == pytest.approx(np.log(100 / 0.05 / 2))
