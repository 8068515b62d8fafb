"""Filter and derivative against SciPy's and against signals known in closed form."""

import numpy as np
import pytest
from scipy import signal as scipy_signal

from ident.signals.zero_phase import Lowpass, extended, fast_length, spectrum


def filtered(x, lowpass, derivative=0, every=1):
    margin = every * int(np.ceil(lowpass.memory_s * lowpass.rate_hz / every))
    length = fast_length(len(x) + 2 * margin, every)
    long = extended(x, margin, length - margin - len(x))
    y = spectrum(long, lowpass.rate_hz).signal(lowpass, derivative, every)
    return y[margin // every :][: -(-len(x) // every)]


def test_the_single_pass_lies_at_minus_3_db_at_its_cutoff():
    """The trap of a normalised cut-off puts this point a factor pi away."""
    lowpass = Lowpass(2.5, 3, 500.0)
    t = np.arange(20_000) / 500.0
    sine = np.sin(2 * np.pi * 2.5 * t)[:, None]
    both = np.abs(filtered(sine, lowpass)[5000:15_000]).max()
    assert 20 * np.log10(np.sqrt(both)) == pytest.approx(-3.0103, abs=1e-3)


def test_the_real_minus_3_db_point_of_both_passes():
    lowpass = Lowpass(7.85, 3, 1000.0)
    below, above = lowpass.gain(np.array([6.77, 6.79]))  # what filtfilt of the study does
    assert below > np.sqrt(0.5) > above


@pytest.mark.parametrize(
    ("cutoff", "order", "rate"), [(2.5, 3, 500.0), (10.0, 3, 50.0), (30, 4, 5e3)]
)
def test_it_is_scipys_filter_forward_and_backward(cutoff, order, rate):
    rng = np.random.default_rng(0)
    x = np.cumsum(rng.normal(size=(6000, 2)), axis=0)
    sections = scipy_signal.butter(order, cutoff, fs=rate, output="sos")
    wanted = scipy_signal.sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=5000)
    found = filtered(x, Lowpass(cutoff, order, rate))
    assert np.abs(found - wanted).max() < 1e-5 * np.abs(x).max()


def test_derivatives_of_a_slow_sine_are_exact():
    lowpass = Lowpass(25.0, 3, 500.0)
    t = np.arange(5000) / 500.0
    omega = 2 * np.pi * 0.5
    x = np.sin(omega * t)[:, None]
    inside = slice(500, -500)
    np.testing.assert_allclose(
        filtered(x, lowpass, 1)[inside, 0], omega * np.cos(omega * t)[inside], atol=1e-6
    )
    np.testing.assert_allclose(
        filtered(x, lowpass, 2)[inside, 0], -(omega**2) * np.sin(omega * t)[inside], atol=1e-5
    )


def test_a_lower_rate_keeps_the_same_values():
    rng = np.random.default_rng(1)
    x = np.cumsum(rng.normal(size=(4000, 1)), axis=0)
    lowpass = Lowpass(5.0, 3, 500.0)
    np.testing.assert_allclose(
        filtered(x, lowpass, every=10), filtered(x, lowpass)[::10], atol=1e-6 * np.ptp(x)
    )


def test_an_input_is_forgotten_after_the_memory():
    lowpass = Lowpass(5.0, 3, 500.0)
    impulse = np.zeros((8000, 1))
    impulse[4000] = 1.0
    response = np.abs(spectrum(impulse, 500.0).signal(lowpass))[:, 0]
    far = int(lowpass.memory_s * 500)
    assert response[: 4000 - far].max() < 2e-11 * response.max()


def test_continuation_keeps_value_and_slope():
    x = np.arange(6.0)[:, None] * 2 + 1
    np.testing.assert_allclose(extended(x, 2, 3)[:, 0], np.arange(-2, 9) * 2 + 1)
    with pytest.raises(ValueError, match="6 samples cannot be continued by 6"):
        extended(x, 0, 6)


@pytest.mark.parametrize(("least", "multiple"), [(1, 1), (17, 4), (13_001, 10), (997, 1)])
def test_fast_lengths_have_small_factors_only(least, multiple):
    length = fast_length(least, multiple)
    assert length >= least
    assert length % multiple == 0
    rest = length // multiple
    for prime in (2, 3, 5):
        while rest % prime == 0:
            rest //= prime
    assert rest == 1
    assert length < 1.35 * least + 5 * multiple
