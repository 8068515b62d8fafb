"""Recordings as uniform samples: joints, stamps, torque."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_arm import recording

from ident.recordings.dataset import dataset
from ident.recordings.errors import JointMismatchError
from ident.recordings.samples import held_mean, resampled
from ident.recordings.steady_state import only_steady_state
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Command, ReferenceSeries
from wamctl.arm.trajectory import read_trajectory, reference, trajectory_yaml

NAMES = ("a", "b")


def made(t, q, effort=None, names=NAMES, **more):
    effort = np.ones_like(q) if effort is None else effort
    return recording(names, np.asarray(t, dtype=float), q, effort, **more)


def sines(t):
    t = np.asarray(t, dtype=float)
    return np.column_stack([np.sin(t), np.cos(2 * t)])


def test_joints_are_matched_by_name_in_any_order():
    t = np.arange(100) / 50
    q = sines(t)
    data = dataset(made(t, q[:, ::-1], q[:, ::-1], ("b", "a")), NAMES, "log")
    np.testing.assert_allclose(data.segments[0].q, q)
    np.testing.assert_allclose(data.segments[0].tau, q)


def test_missing_joints_are_named():
    t = np.arange(10) / 50
    with pytest.raises(JointMismatchError) as caught:
        dataset(made(t, sines(t)), ("a", "c"), "log.mcap")
    assert str(caught.value) == "log.mcap has no joint 'c'; its joints are a, b."


def test_the_commanded_torque_comes_first_and_either_can_be_asked_for():
    t = np.arange(100) / 50
    stamps = np.round(t * 1e9).astype(np.int64)
    command = Command(stamps, None, None, 5.0 * np.ones((100, 2)))
    log = made(t, sines(t), command=command)
    assert dataset(log, NAMES, "log").torque == "commanded"
    assert dataset(log, NAMES, "log").segments[0].tau[50, 0] == pytest.approx(5.0)
    assert dataset(log, NAMES, "log", "measured").segments[0].tau[50, 0] == pytest.approx(1.0)
    with pytest.raises(DataError, match="log holds no measured torque; leave out --torque"):
        dataset(replace(log, effort=None), NAMES, "log", "measured")
    with pytest.raises(DataError, match="log holds no commanded torque; leave out --torque"):
        dataset(replace(log, command=None), NAMES, "log", "commanded")


def test_a_held_torque_belongs_half_to_the_sample_before_and_half_to_the_one_after():
    t = np.arange(6) * 0.002
    held = np.array([[0.0], [2.0], [4.0], [8.0], [8.0], [0.0]])
    found = held_mean(t, held, t[1:], 0.002)
    np.testing.assert_allclose(found[:, 0], [1.0, 3.0, 6.0, 8.0, 4.0])


def test_irregular_stamps_are_resampled():
    rng = np.random.default_rng(0)
    t = np.arange(400) / 100 + rng.uniform(-0.003, 0.003, 400)
    data = dataset(made(t, sines(t)), NAMES, "log")
    (segment,) = data.segments
    grid = segment.start_s + np.arange(len(segment.q)) / data.rate_hz + t[0]
    np.testing.assert_allclose(segment.q, sines(grid), atol=2e-5)


def test_cubic_resampling_is_exact_for_cubics():
    t = np.sort(np.random.default_rng(1).uniform(0, 5, 40))
    grid = np.linspace(t[0], t[-1], 77)
    np.testing.assert_allclose(resampled(t, (t**3 - t)[:, None], grid)[:, 0], grid**3 - grid)


def test_repeated_stamps_are_left_out_and_told():
    t = np.arange(100) / 50
    t[40] = t[39]
    data = dataset(made(t, sines(t)), NAMES, "log")
    assert data.facts[0] == "1 samples repeat the stamp before them and were left out"


@pytest.mark.parametrize("late", [0, 1])
def test_a_recorder_faster_than_its_source_leaves_the_readings(late):
    """Three messages to a reading, some of them late; the arm stands still for a second."""
    t = np.arange(600) / 200
    q = sines(np.where(t < 1.5, t, np.maximum(t - 1.0, 1.5)))
    shown = np.arange(1800) // 3
    shown[1:] -= late * (np.arange(1799) % 30 == 0)
    log = made(np.arange(1800) / 600, q[shown], 3.0 * q[shown])
    data = dataset(log, NAMES, "log")
    assert data.rate_hz == pytest.approx(200.0)
    assert data.source.lost <= 2
    assert data.samples == pytest.approx(600, abs=2)
    q_read = np.concatenate([s.q for s in data.segments])[:250]
    np.testing.assert_allclose(q_read, q[: len(q_read)], atol=0.02 * late + 1e-9)
    assert data.facts == (
        "the recorder wrote each reading 3 times; the copies were left out, and 200 Hz are left",
    )


def test_readings_that_repeat_now_and_then_are_no_copies():
    rng = np.random.default_rng(11)
    shown = np.maximum.accumulate(np.where(rng.random(1800) < 0.6, 0, np.arange(1800)))
    data = dataset(made(np.arange(1800) / 600, sines(shown / 600)), NAMES, "log")
    assert data.source.copies == 1.0
    assert data.rate_hz == pytest.approx(600.0)


def test_stamps_that_run_backwards_are_refused():
    t = np.arange(100) / 50
    t[40] = t[30]
    with pytest.raises(DataError) as caught:
        dataset(made(t, sines(t)), NAMES, "log")
    assert str(caught.value) == (
        "log: the stamp of sample 40 lies 0.18 s before the one ahead of it; sort or repair the"
        " recording."
    )


def test_a_hole_parts_the_recording():
    t = np.concatenate([np.arange(100) / 50, 5.0 + np.arange(100) / 50])
    data = dataset(made(t, sines(t)), NAMES, "log")
    assert [len(s.q) for s in data.segments] == [100, 100]
    assert data.segments[1].start_s == pytest.approx(5.0)
    assert data.facts == ("holes of more than 10 periods end at 5.000 s",)


def test_a_joint_that_hardly_moves_is_held_at_the_right_angle_beside_it():
    t = np.arange(200) / 50
    q = np.column_stack([np.sin(t), 1.57 + 0.01 * np.sin(9 * t)])
    data = dataset(made(t, q), NAMES, "log")
    assert data.moving.tolist() == [True, False]
    assert np.unique(data.segments[0].q[:, 1]) == pytest.approx([np.pi / 2])
    assert data.facts == ("held: b",)
    with pytest.raises(DataError, match=r"log: no joint moves by more than 0\.05 rad"):
        dataset(made(t, 0.01 * q), NAMES, "log")


def test_a_sliding_joint_is_held_where_it_is():
    t = np.arange(200) / 50
    q = np.column_stack([np.sin(t), np.full(200, 0.03)])
    turning, sliding = (dataset(made(t, q), NAMES, "log", None, s) for s in ((), (False, True)))
    assert turning.place.tolist() == [0.0, 0.0]
    assert sliding.place.tolist() == [0.0, pytest.approx(0.03)]


def test_recorded_joints_that_the_model_lacks_are_told():
    t = np.arange(200) / 50
    assert dataset(made(t, sines(t)), ("a",), "log").facts == (
        "recorded, but no joints of the model: b",
    )


def test_only_the_counted_periods_give_rows():
    trajectory = read_trajectory("wam7-excitation.yaml")
    wanted = reference(trajectory.series, 2, 1.0, 0.02)
    names = trajectory.series.joint_names
    stamps = np.round(wanted.t * 1e9).astype(np.int64)
    text = trajectory_yaml(replace(trajectory, periods=2)).encode()
    log = made(
        wanted.t,
        wanted.q,
        names=names,
        reference=ReferenceSeries(stamps, wanted.q, wanted.qd, wanted.qdd),
        attachments={"trajectory.yaml": text},
    )
    data = only_steady_state(dataset(log, names, "log"), log, "log")
    assert data.segments[0].used == (wanted.counted.start, wanted.counted.stop)
    assert data.samples == 2000
    assert len(data.segments[0].q) == len(wanted.t)
