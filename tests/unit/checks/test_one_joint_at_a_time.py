"""Recordings in which one joint moves and the others are held, which their friction does too."""

import numpy as np
import pytest
from chain_arm import Experiment, Log, inverse

from ident.checks.examine import examine
from ident.regression.probe import chunks_of, probe_of
from ident.workflows.run import run_data

JOINTS = 6


def alone(joint: int, seed: int = 0) -> Log:
    """One joint leaves its zero and comes back; brakes and friction hold the others, somehow."""
    log, rng = (
        Experiment(joints=JOINTS, seconds=20.0, seed=seed).log(),
        np.random.default_rng(seed + joint),
    )
    q = np.zeros_like(log.q)
    q[:, joint] = log.q[:, joint] * np.clip(np.minimum(log.t, 20.0 - log.t) / 2.0, 0.0, 1.0)
    qd, qdd = derivatives(log.with_(q=q))
    usual, brisk = np.sqrt(np.mean(log.tau**2, axis=0)), qd.std(axis=0)[joint]
    slow = np.sin(0.3 * log.t[:, None] + rng.uniform(0.0, 6.0, JOINTS))
    held = rng.uniform(-0.5, 0.5, JOINTS) + 0.2 * slow
    rubbing = 0.05 * (np.tanh(qd / (0.02 * brisk)) + qd / brisk)
    own = np.where(np.arange(JOINTS) == joint, rubbing, held) + 0.01 * rng.normal(size=q.shape)
    return log.with_(q=q, tau=inverse(log.urdf, q, qd, qdd) + usual * own)


def derivatives(log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration, the encoder's steps smoothed away."""
    window = np.hanning(21) / np.hanning(21).sum()
    smooth = np.apply_along_axis(np.convolve, 0, np.pad(log.q, ((10, 10), (0, 0)), "edge"), window,
                                 "valid")  # fmt: skip
    qd = np.gradient(smooth, log.t, axis=0)
    return qd, np.gradient(qd, log.t, axis=0)


def codes(*logs: Log) -> set[str]:
    arm = logs[0].arm()
    remarks = examine(arm, [log.dataset(arm, f"log_{i}") for i, log in enumerate(logs)]).remarks
    return {r.code for r in remarks}


@pytest.mark.parametrize("seed", range(3))
def test_what_holds_a_joint_is_taken_for_no_fault(seed):
    """The torque of held joints fitted another joint's place by chance: all were refused."""
    each = [alone(k, seed) for k in range(JOINTS)]
    assert codes(*each) <= {"poor_motion"}
    assert codes(Experiment(joints=JOINTS, seconds=20.0, seed=seed).log(), *each) == set()


@pytest.mark.thorough
def test_they_do_no_harm_beside_a_motion_of_all_joints():
    whole = Experiment(joints=JOINTS, seconds=20.0).log()
    arm, friction, remarks = whole.arm(), [], []
    for logs in ([whole], [whole, *(alone(k) for k in range(JOINTS))]):
        data = [log.dataset(arm, f"log_{i}") for i, log in enumerate(logs)]
        found = run_data(arm, data)
        friction.append(found.model.parameter("fc"))
        remarks += found.content["remarks"]
    assert "recordings_disagree" not in [r["code"] for r in remarks]  # in what both of them tell
    np.testing.assert_allclose(friction[1], friction[0], rtol=0.2)


def test_a_joint_that_moves_at_the_end_of_a_recording_only_is_judged_while_it_moves():
    """What held it before was fitted as well, and hid what it did in the end."""
    long, short = alone(3), alone(1)
    end = slice(0, 200)
    q, tau = (np.concatenate([getattr(long, x), getattr(short, x)[end]]) for x in ("q", "tau"))
    both = long.with_(t=np.arange(len(q)) / 100.0, q=q, tau=tau)
    assert codes(Experiment(joints=JOINTS, seconds=20.0).log(), both) == set()


def test_joints_that_move_slowly_all_the_time_count_all_the_time():
    """What the filter is given beyond both ends of a recording is faster than the motion."""
    log = Experiment(joints=JOINTS, seconds=60.0, rate_hz=20.0, speed=0.1, seed=2).log()
    data = log.dataset(log.arm())
    probe = probe_of(chunks_of([data]), data.moving[None], 1.0, 500)
    assert probe.counted.mean(axis=0).min() > 0.98
