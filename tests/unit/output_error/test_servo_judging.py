"""How errors of simulated positions are compared: no few blocks of time decide."""

import numpy as np

from ident.output_error.missing.judging import explained, gain, sureness, typical

RESTING = 4e-6  # rad^2: a joint that rests on the other side of its friction, 2 mrad away


def errors(rng: np.random.Generator, size: float) -> np.ndarray:
    """Mean squares of 60 blocks of one joint [rad^2], shape (60, 1)."""
    return size**2 * rng.chisquare(20, (60, 1)) / 20


def test_few_blocks_in_which_a_joint_rests_elsewhere_are_no_gap() -> None:
    before = errors(np.random.default_rng(0), 1e-4)
    after = before.copy()
    before[[5, 20, 33]] = RESTING

    assert gain(before, after)[0] < 0.2  # of mean squares it would be 1.5
    assert sureness(before, after)[0] < 3.0
    assert typical(before)[0] < 1.3e-4


def test_an_effect_in_all_blocks_counts_whole() -> None:
    rng = np.random.default_rng(1)
    before, after = errors(rng, 2e-4), errors(rng, 1e-4)

    np.testing.assert_allclose(gain(before, after), np.log(2.0), atol=0.1)
    assert sureness(before, after)[0] > 10.0
    np.testing.assert_allclose(explained(before, after), np.sqrt(3.0) * 1e-4, rtol=0.1)
