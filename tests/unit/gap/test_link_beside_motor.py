"""A link beside its motor: its way through a play, and on a spring."""

import numpy as np
import pytest

from ident.effects.motor_link import integrate_link_motion

PERIOD = 0.01
HALF = 2e-3


def beside(q, pull, dry, start=-HALF):
    """The link beside a motor on a given way, pulled and rubbed."""
    t = PERIOD * np.arange(len(q))
    drag = np.array([np.full(len(q), dry), np.zeros(len(q))])
    pull, grip = np.full(len(q), pull), np.zeros(len(q))
    return integrate_link_motion(
        (q, np.gradient(q, t)), pull, drag, (grip, 0.0), start, HALF, PERIOD
    )[0]


def test_a_link_falls_through_its_play_and_stays_at_the_end():
    pull = 0.2
    y = beside(np.zeros(100), pull, 0.0)
    fall = np.minimum(-HALF + pull * (PERIOD * np.arange(100)) ** 2 / 2, HALF)
    assert y == pytest.approx(fall, abs=2e-4)
    assert y[-1] == pytest.approx(HALF)


def test_a_link_that_rubs_stays_until_the_motor_has_crossed_the_play():
    q = 5e-3 * (1.0 - np.cos(np.linspace(0.0, np.pi, 200)))
    y = beside(q, 0.2, 0.5, start=HALF)
    free = q < 2 * HALF
    assert y[free] == pytest.approx(HALF - q[free], abs=1e-5)
    carried = ~free & (np.gradient(q) > 0.9 * np.gradient(q).max())
    assert y[carried] == pytest.approx(-HALF, abs=1e-9)


def test_a_link_moves_with_its_motor_where_it_is_pushed():
    q = 0.3 * np.sin(np.linspace(0.0, 1.5, 200))
    assert beside(q, -5.0, 0.0) == pytest.approx(np.full(200, -HALF), abs=1e-9)


def on_spring(hertz, pull, damped, seconds=4.0):
    """A link that starts at rest where its motor stands still, beside it; friction beside none."""
    still = np.zeros(int(seconds / PERIOD))
    grip = np.full(len(still), (2 * np.pi * hertz) ** 2)
    none = np.zeros((2, len(still)))
    return integrate_link_motion(
        (still, still), still + pull, none, (grip, damped), 0.0, np.inf, PERIOD
    )


def test_a_link_on_a_spring_settles_where_it_balances_the_pull():
    y, rubbed = on_spring(3.0, 2.0, 0.3)
    assert y[-1] == pytest.approx(2.0 / (2 * np.pi * 3.0) ** 2, rel=1e-3)
    assert rubbed == pytest.approx(np.zeros(len(y)), abs=1e-9)


def test_a_link_on_a_soft_spring_swings_at_its_frequency():
    y = on_spring(2.0, 1.0, 0.02)[0]
    turns = np.flatnonzero(np.diff(np.sign(y - 1.0 / (2 * np.pi * 2.0) ** 2)))
    half = np.median(np.diff(turns[:10])) * PERIOD
    assert half == pytest.approx(0.25, abs=0.02)


def test_a_loose_link_spares_the_motor_what_it_rubs():
    """The motor moves off, the link stays: its friction is what holds it, not the motor's way."""
    q = np.linspace(0.0, 3e-3, 40)
    speed = np.full(40, q[-1] / (39 * PERIOD))
    drag = np.tile([[5.0], [0.0]], 40)
    still, none = np.zeros(40), np.zeros(40)
    beside, rubbed = integrate_link_motion((q, speed), still, drag, (none, 0.0), HALF, HALF, PERIOD)
    assert beside[1:] == pytest.approx(HALF - q[1:], abs=1e-6)
    assert rubbed[2:] == pytest.approx(np.full(38, -5.0), rel=0.01)
