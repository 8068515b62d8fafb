"""Axes, thinning, and words."""

import math
from collections.abc import Callable

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from ident.report.axis import Axis, linear_axis, logarithmic_axis, time_axis
from ident.report.figures import region_map, shade
from ident.report.plot import BUCKETS, thinned
from ident.report.words import (
    DASH,
    fixed,
    joint_labels,
    joints_text,
    listed,
    number,
    plus_minus,
    setting,
    unit_text,
)

finite = st.floats(-1e9, 1e9, allow_subnormal=False)


@given(st.lists(finite, min_size=1, max_size=20))
def test_linear_axes_hold_all_values(values: list[float]) -> None:
    axis = linear_axis("x [1]", [np.array(values)], (0.0, 100.0))
    places = axis.place(np.array(values))
    assert np.all((places > -1e-6) & (places < 100.0 + 1e-6))
    assert len(axis.ticks) == len(set(axis.labels)) or max(map(abs, values)) > 1e6
    assert 2 <= len(axis.ticks) <= 9


@given(st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=20))
def test_logarithmic_axes_hold_all_values(values: list[float]) -> None:
    axis = logarithmic_axis("x [1]", [np.array(values)], (0.0, 100.0))
    places = axis.place(np.array(values))
    assert np.all((places > -0.1) & (places < 100.1))
    assert len(axis.ticks) >= 2


def test_axes_without_values_are_still_axes() -> None:
    nothing = np.array([np.nan])
    for axis in (
        linear_axis("x [1]", [nothing], (0.0, 1.0)),
        logarithmic_axis("x [1]", [nothing], (0.0, 1.0)),
        time_axis("t [s]", nothing, (0.0, 1.0)),
    ):
        assert axis.high > axis.low
        assert axis.ticks


def test_ticks_are_round() -> None:
    axis = linear_axis("x [1]", [np.array([-0.43, 1.7])], (0.0, 1.0))
    assert axis.labels == ["−0.5", "0.0", "0.5", "1.0", "1.5", "2.0"]


@pytest.mark.parametrize("axis", [linear_axis, time_axis])
def test_no_tick_is_minus_zero(axis: Callable[..., Axis]) -> None:
    made = axis("x", [np.array([-0.6, 4.2])], (0.0, 100.0))
    assert "0" in made.labels
    assert "−0" not in made.labels


def test_thinning_keeps_single_peaks_and_order() -> None:
    t = np.arange(30_000) / 500.0
    y = np.sin(t)
    y[12_345], y[23_456] = 7.0, -8.0
    thin_t, thin_y = thinned(t, y)
    assert len(thin_t) <= 2 * BUCKETS
    assert np.all(np.diff(thin_t) > 0)
    assert thin_y.max() == 7.0
    assert thin_y.min() == -8.0


def test_thinning_keeps_gaps() -> None:
    t = np.arange(30_000) / 500.0
    y = np.where((t > 20) & (t < 30), np.nan, 1.0)
    thin_t, thin_y = thinned(t, y)
    assert np.isnan(thin_y[(thin_t > 20.5) & (thin_t < 29.5)]).all()
    assert np.isfinite(thin_y[thin_t < 19.5]).all()


def test_maps_say_where_they_are_darkest() -> None:
    values = np.array([[0.1, np.nan], [0.2, 0.4]])
    edges = (np.array([0.0, 1.0, 2.0]), np.array([-1.0, 0.0, 1.0]))
    drawing = region_map("4 elbow", ("q [rad]", "speed [rad/s]"), edges, values, 0.4)
    assert drawing.description == (
        "speed [rad/s] over q [rad]: largest, 0.400, near 1.50 and 0.500."
    )
    assert sum("<rect" in mark for mark in drawing.marks) == 3


def test_shades_darken_evenly() -> None:
    assert (shade(0.0), shade(1.0), shade(7.0)) == ("#f0f6fb", "#003e6b", "#003e6b")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1.2345, "1.23"),
        (-0.00012345, "−0.000123"),
        (1.7e-7, "1.70·10⁻⁷"),
        (123456.0, "123\u202f456"),
        (99.96, "100"),
        (None, DASH),
        (math.nan, DASH),
        (math.inf, DASH),
    ],
)
def test_numbers_in_print(value: float | None, text: str) -> None:
    assert number(value) == text


@given(st.none() | st.floats(allow_nan=True, allow_infinity=True))
def test_no_number_prints_as_a_word(value: float | None) -> None:
    for text in (number(value), fixed(value, 3), plus_minus(value, value), setting(value)):
        assert not any(word in text for word in ("nan", "inf", "None"))
        assert text


def test_values_have_as_many_decimals_as_their_deviation() -> None:
    assert plus_minus(1.23456, 0.0123) == "1.235 ± 0.012"
    assert plus_minus(1234.5, 67.0, "N m") == "1\u202f234 ± 67\u202fN·m"
    assert plus_minus(0.5, None) == "0.500"
    assert fixed(-0.00001, 3) == "0.000"


@pytest.mark.parametrize(
    ("names", "labels"),
    [
        (["wam/base_yaw_joint", "wam/elbow_pitch_joint"], ["1 base yaw", "2 elbow pitch"]),
        (["joint1", "joint2"], ["joint1", "joint2"]),
        (["shoulder_pan_joint", "elbow_joint"], ["1 shoulder pan", "2 elbow"]),
        (["only_joint"], ["1 only joint"]),
        (["J2", "J4"], ["1 J2", "2 J4"]),
    ],
)
def test_labels_of_joints(names: list[str], labels: list[str]) -> None:
    assert joint_labels(names) == labels


def test_the_word_joint_stands_once_in_a_sentence() -> None:
    assert joints_text(["joint5"]) == "joint 5"
    assert joints_text(["1 base", "joint2", "joint"]) == "joints 1 base, 2, and joint"


def test_words() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b, and c"
    assert unit_text("N m s/rad") == "N·m·s/rad"
