"""Recordings in which stamps and motion disagree at one step: no blow is told from that."""

from dataclasses import replace

import numpy as np
import pytest
from pendulum import pendulum

from ident.checks.remark import Grade
from ident.gap.data.broken_time import unbroken
from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.gap.settings import BrokenTime
from ident.model.arm import arm_from_urdf
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.workflows.gap import gap_of
from ident.workflows.gap_outcome import counted
from wamctl.arm.recording import Recording
from wamctl.arm.robot import inverse_dynamics

HZ, SAMPLES, AT = 200, 2400, 1500
NAMES = ("shoulder", "elbow")
ARM = arm_from_urdf(pendulum(), NAMES, "pendulum.urdf")
WHOLE = np.arange(SAMPLES)
LOST = np.delete(WHOLE, np.arange(AT + 1, AT + 3))


def moved(t):
    """Positions, velocities and accelerations of a pendulum, shapes (S, 2)."""
    rates, sizes = np.array([[1.9, 2.6], [4.4, 6.1]]), np.array([[0.9, 1.1], [0.5, 0.4]])
    angle = t[:, None, None] * rates
    q = (sizes * np.sin(angle)).sum(axis=1)
    qd = (sizes * rates * np.cos(angle)).sum(axis=1)
    return q, qd, -(sizes * rates**2 * np.sin(angle)).sum(axis=1)


def torque(t):
    """Mean torque around each sample, with friction and some noise, shape (S, 2)."""
    tau = 0.01 * np.random.default_rng(0).normal(size=(len(t), 2))
    for part in (np.arange(4) - 1.5) / 4 / HZ:
        q, qd, qdd = moved(t + part)
        tau += (inverse_dynamics(ARM.robot, q, qd, qdd) + 0.4 * np.sign(qd) + 0.3 * qd) / 4
    return tau


def recording(samples=WHOLE, late=(), push=0.0, noise=0.0, seed=1):
    """Some of the samples, or some twice; their stamps; what pushes joint 2 for 0.15 s at 4 s.

    Args:
        samples: which ones, in order; their stamps stay even.
        late: pairs of a sample from which all stamps are later, and by how many periods.
        push: torque that the arm's motors must give more [N m].
        noise: of the positions [rad].
        seed: of that noise.
    """
    t = WHOLE / HZ
    q, tau = moved(t)[0], torque(t)
    q = q + noise * np.random.default_rng(seed).normal(size=q.shape)
    tau[(t > 4.0) & (t < 4.15), 1] += push
    stamps = np.arange(len(samples)).astype(float)
    for at, periods in late:
        stamps[at:] += periods
    ns = (stamps * 1e9 / HZ).astype(np.int64)
    return Recording(NAMES, ns, q[samples], None, tau[samples])


def cut(found, **bounds):
    """Places at which a recording is cut, and the remarks."""
    data = dataset_for(ARM, summarise_log(found, "log"))
    done, remarks = unbroken(data, BrokenTime(**bounds))
    return [b[1:] for b in done.breaks], remarks


@pytest.mark.parametrize(
    ("samples", "late", "off_ms"),
    [
        (LOST, (), 10.0),
        (np.insert(WHOLE, AT, AT), (), -5.0),
        (WHOLE, ((AT + 1, 4),), -20.0),
    ],
    ids=["lost, stamps even", "written twice", "stamped late"],
)
def test_readings_at_wrong_times_are_cut_out(samples, late, off_ms):
    ((first, last),), (remark,) = cut(recording(samples, late))
    assert first <= AT < last < AT + 8
    assert remark.grade is Grade.TRUSTWORTHY
    assert f"at 7.500 s all joints are {abs(off_ms):g} ms" in remark.finding
    assert ("ahead of" if off_ms > 0 else "behind") in remark.finding


PAUSED = 1720


def paused(late_ms):
    """The recording of an arm whose controller pauses, and catches up within some samples."""
    found = recording()
    late = np.zeros(SAMPLES)
    late[PAUSED + 1 : PAUSED + 1 + len(late_ms)] = np.array(late_ms) / 1e3
    found.q[:] = moved(WHOLE / HZ - late)[0]
    return found


def test_a_pause_of_the_controller_is_cut_out():
    found = paused((1.2, 0.9, 0.5, 0.2))
    ((first, last),), (remark,) = cut(found)
    assert first <= PAUSED < last < PAUSED + 8
    assert remark.grade is Grade.TRUSTWORTHY
    assert "all joints are 1.3 ms behind" in remark.finding  # beside steps that catch up
    assert "the controller paused" in remark.finding
    assert cut(found, least_pause=0.5) == ([], [])
    found.q[:, 1] = moved(WHOLE / HZ)[0][:, 1]  # one joint alone sticks
    assert cut(found) == ([], [])


def test_the_arm_is_left_whole_where_it_moves_as_stamped():
    assert cut(recording()) == ([], [])
    assert cut(recording(noise=1e-4)) == ([], [])
    stops = recording()
    stops.q[AT:] = stops.q[AT]  # an impact: velocity ends, positions go on from where they were
    assert cut(stops) == ([], [])
    pulled = recording()
    pulled.q[AT - 100 :, 1] += 0.02  # one joint alone
    assert cut(pulled) == ([], [])


def test_a_blow_while_all_joints_turn_round_is_a_blow():
    found = recording()
    found.q[: AT + 1] = np.arange(-AT, 1)[:, None] * (-0.47, -0.49) / HZ
    found.q[AT + 1 :] = (0.34, 1.07) / np.float64(HZ)
    found.q[AT + 1 :] += np.arange(SAMPLES - AT - 1)[:, None] * (0.17, 0.06) / HZ
    assert cut(found) == ([], [])


def test_missing_samples_are_bridged_as_far_as_the_fastest_motion_is_known():
    for lost, expected in ((3, []), (4, [(AT, AT + 5)])):
        kept = np.delete(WHOLE, np.arange(AT + 1, AT + 1 + lost))
        assert cut(recording(kept, ((AT + 1, lost),))) == (expected, [])


def test_what_cannot_be_cut_out_is_doubtful():
    late = tuple((at, 2) for at in range(200, 2400, 400))
    places, (remark,) = cut(recording(late=late))
    assert 0 < len(places) < len(late)
    assert remark.grade is Grade.DOUBTFUL
    assert "(6 such steps)" in remark.finding


def test_a_push_is_named_and_a_late_stamp_is_none():
    late = ((AT + 1, 4),)
    found = []
    for push in (0.0, 3.0):
        one = of_arm(ARM, None, [recording(late=late, push=push)], ["log"])
        content = gap_of(one, Options(null_runs=0), lambda *told: None).content
        assert content["trust"] == "trustworthy"
        found.append([(e["name"], e["joints"]) for e in content["effects"]])
    assert found == [[], [("contact", [2])]]


def test_the_model_is_fitted_to_and_judged_on_the_whole_recording():
    """Of the parts, a filter may leave little: a model with 109 % error was told to have 3."""
    one = of_arm(ARM, None, [recording(late=((AT + 1, 4),))], ["log"])
    cut_there = replace(one, datasets=tuple(unbroken(d, BrokenTime())[0] for d in one.datasets))
    assert [len(d.segments) for d in cut_there.datasets] == [2]
    assert [len(d.segments) for d in counted(cut_there)] == [1]
