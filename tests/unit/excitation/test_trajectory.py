"""The series (46), its reference with ramps, and its file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wamctl.arm.errors import ConfigurationError
from wamctl.arm.trajectory import (
    FourierSeries,
    Trajectory,
    read_trajectory,
    reference,
    sample,
    write_trajectory,
)

PERIOD_S = 0.002


@pytest.fixture
def series(rng: np.random.Generator) -> FourierSeries:
    a, b = rng.normal(size=(2, 3, 5))
    return FourierSeries(("x", "y", "z"), 0.1 * np.pi, a, b, rng.normal(size=3))


def test_series_is_the_papers(series: FourierSeries) -> None:
    t = np.array([0.0, 1.3, 17.0])
    q, _, _ = sample(series, t)
    for i, time in enumerate(t):
        wanted = series.q0.copy()
        for harmonic in range(1, 6):
            w = series.fundamental_rad_s * harmonic
            wanted += series.a[:, harmonic - 1] / w * np.sin(w * time)
            wanted -= series.b[:, harmonic - 1] / w * np.cos(w * time)
        assert q[i] == pytest.approx(wanted, abs=1e-12)


def test_reference_starts_and_ends_at_rest(series: FourierSeries) -> None:
    motion = reference(series, 3, 3.0, PERIOD_S)
    for at in (0, -1):
        assert motion.qd[at] == pytest.approx(np.zeros(3), abs=1e-12)
        assert motion.qdd[at] == pytest.approx(np.zeros(3), abs=1e-12)


def test_counted_part_is_exactly_the_series(series: FourierSeries) -> None:
    motion = reference(series, 3, 3.0, PERIOD_S)
    t = np.arange(30_000) * PERIOD_S
    q, qd, qdd = sample(series, t)
    assert np.abs(motion.q[motion.counted] - q).max() < 1e-12
    assert np.abs(motion.qd[motion.counted] - qd).max() < 1e-12
    assert np.abs(motion.qdd[motion.counted] - qdd).max() < 1e-12


def test_derivatives_agree_on_the_ramps_too(series: FourierSeries) -> None:
    motion = reference(series, 1, 2.0, PERIOD_S)
    velocity = np.gradient(motion.q, PERIOD_S, axis=0)[1:-1]
    acceleration = np.gradient(motion.qd, PERIOD_S, axis=0)[1:-1]
    assert np.abs(velocity - motion.qd[1:-1]).max() < 1e-4
    assert np.abs(acceleration - motion.qdd[1:-1]).max() < 1e-3


def test_ramps_pass_no_speed_of_the_series(series: FourierSeries) -> None:
    motion = reference(series, 1, 3.0, PERIOD_S)
    fastest = np.abs(motion.qd[motion.counted]).max(axis=0)
    assert (np.abs(motion.qd).max(axis=0) <= fastest + 1e-9).all()


def test_file_keeps_every_bit(series: FourierSeries, tmp_path: Path) -> None:
    promise = {"condition_number": 33.25, "parameters": 57}
    write_trajectory(tmp_path / "t.yaml", Trajectory(series, 4, promise, {"margin": 0.1}))
    back = read_trajectory(tmp_path / "t.yaml")
    assert back.periods == 4
    assert back.promise == promise
    assert back.limits == {"margin": 0.1}
    assert (back.series.a == series.a).all()
    assert (back.series.b == series.b).all()
    assert (back.series.q0 == series.q0).all()
    assert [p.name for p in tmp_path.iterdir()] == ["t.yaml"]


def test_all_faults_of_a_file_at_once(series: FourierSeries, tmp_path: Path) -> None:
    wrong = replace(series, q0=series.q0[:2], b=series.b[:, :4])
    write_trajectory(tmp_path / "t.yaml", Trajectory(wrong, 3, {}, {}))
    with pytest.raises(ConfigurationError) as caught:
        read_trajectory(tmp_path / "t.yaml")
    assert str(caught.value) == (
        f"{tmp_path / 't.yaml'}: 4 faults:\n"
        "  - q0: 2 entries for 3 joints\n"
        "  - b: 4 coefficients for joint 1, 5 for joint 1\n"
        "  - b: 4 coefficients for joint 2, 5 for joint 1\n"
        "  - b: 4 coefficients for joint 3, 5 for joint 1"
    )
