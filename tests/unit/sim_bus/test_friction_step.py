"""The step against the conditions that define it."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bus.plant.friction_step import step

H = 2.5e-4
N = 7


@given(st.integers(0, 10**6), st.integers(0, 3))
@settings(max_examples=400, deadline=None)
def test_the_step_obeys_motion_and_friction(seed, k):
    random = np.random.default_rng(seed)
    half = random.normal(size=(N, N)) * 10.0 ** random.uniform(-2, 0, N)[:, None]
    mass = half @ half.T + np.diag(10.0 ** random.uniform(-5, -1, N))
    slides = random.normal(size=(k, N)) * 10
    coulomb = random.uniform(0, 2, N + k) * (random.random(N + k) < 0.8)
    coulomb[N:] /= 10
    viscous = np.diag(random.uniform(0, 1, N))
    torque, bias = random.normal(size=(2, N)) * 2
    velocity = random.normal(size=N) * (random.random(N) < 0.6) * 1e-2
    q = random.normal(size=N)
    motion = np.array([q, velocity, q, velocity])
    friction = np.array([-coulomb, coulomb, random.uniform(-2, 2, N + k)])
    stops = np.array([np.full(N, -99.0), np.full(N, 99.0), np.zeros(N), np.zeros(N)])

    linear = np.array([np.zeros((N, N)), viscous])
    step(mass, torque - bias, motion, linear, stops, slides, friction, H)

    after, f = motion[1], friction[2]
    all_slides = np.vstack([np.eye(N), slides])
    drag = viscous @ (velocity + after) / 2
    impulse = H * (torque - bias - drag - all_slides.T @ f)
    np.testing.assert_allclose(mass @ (after - velocity), impulse, atol=1e-8)
    assert np.all(np.abs(f) <= coulomb)
    speed = all_slides @ after
    still = 1e-10  # rest, to rounding
    assert np.all(f[speed > still] == coulomb[speed > still])
    assert np.all(f[speed < -still] == -coulomb[speed < -still])
    np.testing.assert_allclose(motion[0], q + 0.5 * H * after)
