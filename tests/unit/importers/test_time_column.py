"""Time columns: dates, stamps that are rounded, and columns that are no clock."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from ident.importers.recording import mapped_recording
from wamctl.arm.errors import ConfigurationError, DataError

ROWS = 40
Q = np.random.default_rng(0).normal(size=ROWS)
START_NS = 1_704_067_200_000_000_000
"""2024-01-01."""
PLAN: dict[str, Any] = {
    "joints": ["a"],
    "time": {"column": "t"},
    "position": {"columns": ["q"]},
    "effort": {"columns": ["u"]},
}


def mapped(folder: Path, times: Any, end: str = ",", **changes: Any) -> Any:
    q = Q if len(times) == ROWS else np.random.default_rng(0).normal(size=len(times))
    lines = [end.join(map(str, row)) for row in zip(times, q, 2 * q, strict=True)]
    (folder / "data.csv").write_text("\n".join([end.join("tqu"), *lines]) + "\n")
    (folder / "map.yaml").write_text(yaml.safe_dump(PLAN | changes))
    return mapped_recording(folder / "data.csv", folder / "map.yaml")


def test_dates_become_stamps_to_the_last_digit(tmp_path: Path) -> None:
    seconds = [f"{k // 50:02}.{k % 50 * 20:03}" for k in range(ROWS)]
    wanted = START_NS + np.arange(ROWS) * 20_000_000
    written: dict[str, Callable[[str], str]] = {
        "T": lambda s: f"2024-01-01T00:00:{s}",
        "space": lambda s: f"2024-01-01 00:00:{s}",
        "Z": lambda s: f"2024-01-01T00:00:{s}Z",
        "zone": lambda s: f"2024-01-01T05:30:{s}+05:30",
        "behind": lambda s: f"2023-12-31 23:00:{s} -0100",
    }
    for how in written.values():
        found = mapped(tmp_path, list(map(how, seconds)))
        np.testing.assert_array_equal(found.stamp_ns, wanted)
        np.testing.assert_array_equal(found.q[:, 0], Q)
    found = mapped(
        tmp_path, [f"2024-01-01T00:00:{s.replace('.', ',')}000001" for s in seconds], ";"
    )
    np.testing.assert_array_equal(found.stamp_ns, wanted + 1)


def test_dates_of_a_parquet_table(tmp_path: Path) -> None:
    stamps = START_NS + np.arange(ROWS) * 20_000_001
    dated = pa.array(stamps.view("datetime64[ns]"))
    pq.write_table(pa.table({"t": dated, "q": Q, "u": 2 * Q}), tmp_path / "data.parquet")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(PLAN))
    found = mapped_recording(tmp_path / "data.parquet", tmp_path / "map.yaml")
    np.testing.assert_array_equal(found.stamp_ns, stamps)


def test_a_date_in_the_wrong_place_is_told(tmp_path: Path) -> None:
    times = [f"2024-01-01T00:00:{k:02}" for k in range(ROWS)]
    with pytest.raises(ConfigurationError, match=r"position\.columns: 't' holds dates there"):
        mapped(tmp_path, times, time={"rate_hz": 50}, position={"columns": ["t"]})
    with pytest.raises(ConfigurationError, match=r"rows\.column: 't' holds dates there"):
        mapped(tmp_path, times, time={"rate_hz": 50}, rows={"column": "t", "equal": 1})
    for wrong in ("2024-13-01T00:00:00", "soon"):
        with pytest.raises(DataError) as caught:
            mapped(tmp_path, [*times[:5], wrong, *times[6:]])
        assert f"line 7, column 't': '{wrong}' is no date such as 2024-01-31T12:" in str(
            caught.value
        )


def test_a_first_row_with_a_date_is_no_header(tmp_path: Path) -> None:
    numbered: dict[str, Any] = {
        "time": {"column": 1}, "position": {"columns": [2]}, "effort": {"columns": [3]},
    }  # fmt: skip
    times = [f"2024-01-01T00:00:{k:02}" for k in range(ROWS)]
    mapped(tmp_path, times, **numbered)
    source, where = tmp_path / "data.csv", tmp_path / "map.yaml"
    source.write_text(source.read_text().split("\n", 1)[1])
    with pytest.raises(DataError, match="the first line holds numbers"):
        mapped_recording(source, where)
    where.write_text(yaml.safe_dump(PLAN | numbered | {"header": False}))
    assert len(mapped_recording(source, where).q) == ROWS


def refused(folder: Path, times: Any, **changes: Any) -> str:
    with pytest.raises(DataError) as caught:
        mapped(folder, times, **changes)
    start = f"{folder / 'data.csv'}: the time column "
    assert str(caught.value).startswith(start)
    return str(caught.value).removeprefix(start)


def test_a_column_that_goes_back_bit_by_bit_is_no_clock(tmp_path: Path) -> None:
    swing = 3 + np.sin(np.arange(200) / 200 * 2 * np.pi)
    assert refused(tmp_path, swing) == (
        "goes back bit by bit, from 4 s to 3.48175 s after 51 to 84 rows: name the column that"
        " holds the time, or write `time: {rate_hz: ...}`, where rows were taken evenly."
    )
    assert refused(tmp_path, 3 + 0.1 * swing).startswith("goes back bit by bit, from 3.4 s")
    assert refused(tmp_path, np.linspace(0.3, 0.0, 30)).startswith("goes back bit by bit")
    two = np.tile(np.arange(20) / 50, 2)
    assert refused(tmp_path, two).startswith("goes back from 0.38 s to 0 s after 20 rows; if")


def test_stamps_in_another_order_than_their_rows_are_taken(tmp_path: Path) -> None:
    times = np.arange(ROWS) / 100
    times[5:7] = times[6], times[5]
    np.testing.assert_allclose(mapped(tmp_path, times).stamp_ns, times * 1e9)
    found = mapped(tmp_path, np.array([0.0, 0.02, 0.01]))
    assert len(found.q) == 3


def test_a_time_that_stands_is_told(tmp_path: Path) -> None:
    assert refused(tmp_path, [1.5] * ROWS) == (
        "holds 1.5 s in all 40 rows: name the column that holds the time, or write"
        " `time: {rate_hz: ...}`, where rows were taken evenly."
    )


@pytest.mark.parametrize(("rate_hz", "step_s"), [(50, 0.1), (75, 0.1), (1000, 0.01), (50, 1.0)])
def test_stamps_that_several_rows_share_are_told(
    tmp_path: Path, rate_hz: float, step_s: float
) -> None:
    exact = 1.7e9 + np.arange(1000) / rate_hz
    said = refused(tmp_path, np.round(np.round(exact / step_s) * step_s, 3))
    assert said.startswith(f"is rounded to about {step_s:g} s, so that about ")
    advised = float(said.split("rate_hz: ")[1].split("}")[0])
    assert advised == pytest.approx(rate_hz, rel=0.02)
    assert said.endswith("in its place, or save the table with more digits of the time.")


def test_readings_that_are_written_twice_are_no_rounded_stamps(tmp_path: Path) -> None:
    times = np.repeat(np.arange(100) / 50, 2)
    names = {"position": {"columns": ["h"]}, "effort": {"columns": ["u"]}}
    assert "2 rows share each stamp" in refused(tmp_path, times)
    held = np.repeat(np.random.default_rng(1).normal(size=100), 2)
    rows = zip(times, held, np.random.default_rng(2).normal(size=200), strict=True)
    lines = [",".join(map(str, row)) for row in rows]
    (tmp_path / "data.csv").write_text("\n".join(["t,h,u", *lines]) + "\n")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(PLAN | names))
    found = mapped_recording(tmp_path / "data.csv", tmp_path / "map.yaml")
    np.testing.assert_array_equal(found.q[:, 0], held)


def test_a_few_rows_may_share_a_stamp(tmp_path: Path) -> None:
    times = np.round(np.arange(200) / 120, 2)  # most have their own
    assert len(mapped(tmp_path, times).q) == 200
