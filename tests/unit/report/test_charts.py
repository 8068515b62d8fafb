"""Charts as data, and words."""

import hashlib
import json
import math
from importlib.resources import files

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from ident.report.charts import (
    BUCKETS,
    Curve,
    Panel,
    kept_samples,
    line_chart,
    map_chart,
    row_chart,
    spans_of,
)
from ident.report.style import AFTER, BEFORE, MEASURED
from ident.report.words import DASH, fixed, number, plus_minus, setting, unit_text
from wamctl.arm.joint_labels import joint_labels, joints_text, listed


def test_the_chart_library_is_the_published_one() -> None:
    folder = files("ident.report").joinpath("assets")
    source = json.loads(folder.joinpath("source.json").read_text())
    assert source["package"] == "uplot"
    for name, digest in source["sha256"].items():
        assert hashlib.sha256(folder.joinpath(name).read_bytes()).hexdigest() == digest
    script = folder.joinpath("uPlot.iife.min.js").read_text()
    assert f"(v{source['version']})" in script
    assert folder.joinpath("LICENSE-uPlot.txt").read_text().startswith("The MIT License")


def test_thinning_keeps_single_peaks_and_order() -> None:
    t = np.arange(30_000) / 500.0
    y, z = np.sin(t), np.cos(t)
    y[12_345], z[23_456] = 7.0, -8.0
    kept = kept_samples(y, z)
    assert len(kept) <= 4 * BUCKETS + 2
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, len(t) - 1)
    assert y[kept].max() == 7.0
    assert z[kept].min() == -8.0


def test_short_curves_are_whole() -> None:
    assert kept_samples(np.sin(np.arange(100.0))).tolist() == list(range(100))


def test_gaps_become_null() -> None:
    y = np.array([1.0, np.nan, 2.0, np.nan])
    panel = Panel("torque [N·m]", [Curve("measured", MEASURED, y)])
    chart = line_chart("4 elbow", ("time [s]", np.arange(4.0)), [panel])
    assert chart.spec["panels"][0]["series"][0]["y"] == [1.0, None, 2.0, None]
    assert chart.description == "Over time [s]: measured, torque [N·m], from 1.00 to 2.00."


@given(
    st.lists(st.floats(1e-12, 1e9) | st.floats(-1e9, 0.0).map(np.trunc), min_size=1, max_size=20)
)
def test_values_keep_their_shape(values: list[float]) -> None:
    y = np.array(values)
    panel = Panel("x [1]", [Curve("y", MEASURED, y)])
    written = line_chart("", ("t [s]", np.arange(float(len(y)))), [panel]).spec
    reach = np.ptp(y) or np.abs(y).max()
    assert np.abs(written["panels"][0]["series"][0]["y"] - y).max() <= 1e-4 * reach


def test_spans_are_where_something_holds() -> None:
    t = np.arange(10.0)
    inside = np.array([1, 1, 0, 0, 1, 0, 1, 1, 1, 1], dtype=bool)
    assert spans_of(t, inside) == [(0.0, 2.0), (4.0, 5.0), (6.0, 9.0)]
    assert spans_of(t, ~np.ones(10, dtype=bool)) == []


def test_rows_say_their_values() -> None:
    values = {"without": (BEFORE, [0.5, None]), "with": (AFTER, [0.25, math.nan])}
    chart = row_chart("Residual", "rms [N·m]", ["1 base", "2 lift"], values, joined=True)
    assert chart.description == (
        f"rms [N·m]. 1 base: without 0.500, with 0.250; 2 lift: without {DASH}, with {DASH}."
    )
    assert [s["y"] for s in chart.spec["series"]] == [[0.5, None], [0.25, None]]
    assert chart.spec["joined"] == [0, 1]


def test_maps_say_where_they_are_darkest() -> None:
    values = np.array([[0.1, np.nan], [0.2, 0.4]])
    edges = (np.array([0.0, 1.0, 2.0]), np.array([-1.0, 0.0, 1.0]))
    chart = map_chart("4 elbow", ("q [rad]", "speed [rad/s]"), edges, values, 0.4)
    assert chart.description == "speed [rad/s] over q [rad]: largest, 0.400, near 1.50 and 0.500."
    assert chart.spec["z"] == [[0.1, None], [0.2, 0.4]]


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
        (["joint_0", "joint_1"], ["1 joint 0", "2 joint 1"]),
    ],
)
def test_labels_of_joints(names: list[str], labels: list[str]) -> None:
    assert joint_labels(names) == labels


def test_the_word_joint_stands_once_in_a_sentence() -> None:
    assert joints_text(["joint5"]) == "joint 5"
    assert joints_text(["1 base yaw"]) == "joint 1 (base yaw)"
    assert joints_text(["1 base", "joint2", "joint"]) == "joints 1 (base), 2, and joint"


def test_words() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b, and c"
    assert unit_text("N m s/rad") == "N·m·s/rad"
