"""Moves and braking."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wamctl.arm.motion import brake, move, point_speeds

HOME = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])


def is_consistent(motion, period_s):
    """Velocity and acceleration are the derivatives of position."""
    middle = (motion.qd[1:] + motion.qd[:-1]) / 2
    assert np.abs(np.diff(motion.q, axis=0) / period_s - middle).max() < 1e-3
    middle = (motion.qdd[1:] + motion.qdd[:-1]) / 2
    assert np.abs(np.diff(motion.qd, axis=0) / period_s - middle).max() < 0.2


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 1000))
def test_a_move_keeps_half_of_every_limit(wam, seed):
    limits, rng = wam.file.limits, np.random.default_rng(seed)
    lower, upper = np.array(limits.position_lower_rad), np.array(limits.position_upper_rad)
    start, goal = rng.uniform(lower, upper, (2, 7))
    motion = move(wam.robot, limits, start, goal, 0.002)
    assert motion.q[0] == pytest.approx(start)
    assert motion.q[-1] == pytest.approx(goal)
    assert np.abs(motion.qd[[0, -1]]).max() < 1e-6
    is_consistent(motion, 0.002)
    assert (np.abs(motion.qd) <= 0.5 * np.array(limits.velocity_rad_s) + 1e-9).all()
    assert (np.abs(motion.qdd) <= 0.5 * np.array(limits.acceleration_rad_s2) + 1e-9).all()
    points = (limits.elbow_frame, limits.tool_frame)
    speeds = point_speeds(wam.robot, points, motion.q, motion.qd)
    assert (speeds <= 0.51 * np.array([limits.elbow_speed_m_s, limits.tool_speed_m_s])).all()


def test_a_move_to_where_the_arm_is(wam):
    motion = move(wam.robot, wam.file.limits, HOME, HOME, 0.002)
    assert motion.q == pytest.approx(np.tile(HOME, (len(motion.t), 1)))


def test_a_way_on_which_a_solver_for_such_moves_failed(wam):
    """Half the acceleration is reached for an instant just as half of the jerk allows it."""
    goal = HOME + 0.05
    motion = move(wam.robot, wam.file.limits, HOME, goal, 0.002)
    assert motion.q[-1] == pytest.approx(goal)


def test_braking_ends_at_rest_in_time():
    qd = np.array([1.0, -0.5, 0.0])
    motion = brake(np.zeros(3), qd, 0.08, 0.002)
    assert len(motion.t) == 40
    assert motion.qd[-1] == pytest.approx(np.zeros(3))
    assert motion.q[-1] == pytest.approx(qd * 0.04)
    is_consistent(motion, 0.002)
