"""A bristle's state in closed form from reversal to reversal is that of the step-by-step sum."""

import numpy as np
import pytest

from ident.effects.bristle import stretch


def step_by_step(q, distance, slips):
    z = np.zeros(q.size)
    for i in range(1, q.size):
        dx = q[i] - q[i - 1]
        ahead = 1.0 if dx >= 0.0 else -1.0
        if slips:
            z[i] = min(1.0, max(-1.0, z[i - 1] + dx / distance))
        else:
            z[i] = ahead * (1.0 - (1.0 - ahead * z[i - 1]) * np.exp(-abs(dx) / distance))
    return z


@pytest.mark.parametrize("slips", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_along_a_walk_with_rests(seed, slips):
    rng = np.random.default_rng(seed)
    steps = np.round(rng.normal(size=rng.integers(1, 400)), 1)
    q = 1e-3 * np.cumsum(steps * rng.choice([0.1, 1.0]))
    distance = rng.choice([1e-4, 1e-3, 1e-2])
    np.testing.assert_allclose(
        stretch(q, distance, slips), step_by_step(q, distance, slips), atol=1e-12
    )


@pytest.mark.parametrize("samples", [0, 1])
def test_without_motion_there_is_no_stretch(samples):
    assert np.array_equal(stretch(np.ones(samples), 1e-3, True), np.zeros(samples))
