"""Tables of a robot learning framework: vectors of positions and actions, many episodes a file."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from ident.importers.recording import mapped_recording
from wamctl.arm.errors import ConfigurationError, DataError

STATE = np.random.default_rng(0).normal(size=(60, 3)).astype(np.float32)
ACTION = STATE + np.float32(0.1)
MAP: dict[str, Any] = {
    "joints": ["a", "b", "c"],
    "time": {"column": "timestamp"},
    "rows": {"column": "episode_index", "equal": 1},
    "position": {"columns": "observation.state", "unit": "deg"},
    "command_position": {"columns": "action", "unit": "deg"},
}


def dataset(folder: Path, fixed: bool = False) -> Path:
    """Two episodes of 30 frames in one file."""
    kind = pa.list_(pa.float32(), 3) if fixed else pa.list_(pa.float32())
    frame = np.tile(np.arange(30), 2)
    columns = {
        "action": pa.array(ACTION.tolist(), kind),
        "observation.state": pa.array(STATE.tolist(), kind),
        "timestamp": pa.array((frame / 30).astype(np.float32)),
        "frame_index": pa.array(frame),
        "episode_index": pa.array(np.repeat([0, 1], 30)),
        "task": pa.array(["pick"] * 60),
    }
    pq.write_table(pa.table(columns), folder / "file-000.parquet")
    return folder / "file-000.parquet"


def mapped(source: Path, **changes: Any) -> Any:
    plan = source.parent / "map.yaml"
    plan.write_text(yaml.safe_dump({k: v for k, v in (MAP | changes).items() if v is not None}))
    return mapped_recording(source, plan)


@pytest.mark.parametrize("fixed", [False, True])
def test_an_episode_becomes_a_recording(tmp_path: Path, fixed: bool) -> None:
    found = mapped(dataset(tmp_path, fixed))
    np.testing.assert_allclose(found.q, np.radians(STATE[30:], dtype=float))
    np.testing.assert_allclose(found.command.q, np.radians(ACTION[30:], dtype=float))
    np.testing.assert_allclose(found.stamp_ns, np.arange(30) / 30 * 1e9, atol=100)


def test_entries_of_a_vector_that_holds_more_than_the_arm(tmp_path: Path) -> None:
    parts = {place: MAP[place] | {"entries": [3, 1]} for place in ("position", "command_position")}
    found = mapped(dataset(tmp_path), joints=["c", "a"], **parts)
    np.testing.assert_allclose(found.q, np.radians(STATE[30:, [2, 0]], dtype=float))
    np.testing.assert_allclose(found.command.q, np.radians(ACTION[30:, [2, 0]], dtype=float))
    parts["position"] = MAP["position"] | {"entries": [1, 4]}
    with pytest.raises(ConfigurationError) as caught:
        mapped(dataset(tmp_path), joints=["c", "a"], **parts)
    assert str(caught.value).endswith(
        "position.columns: file-000.parquet has there shape (60, 3) for 2 joints"
        " (entries chooses columns of an array)."
    )


def test_episodes_on_end_are_no_recording(tmp_path: Path) -> None:
    source = dataset(tmp_path)
    with pytest.raises(DataError) as caught:
        mapped(source, rows=None, time={"column": "timestamp"})
    assert str(caught.value) == (
        f"{source}: the time column goes back from {29 / 30:g} s to 0 s after 30 rows; if these"
        " are several recordings, choose one with rows.column and rows.equal, or with rows.first"
        " and rows.last."
    )


def test_rows_and_columns_that_are_not_there(tmp_path: Path) -> None:
    source = dataset(tmp_path)
    with pytest.raises(DataError, match=r"has no row with 'episode_index' = 7\."):
        mapped(source, rows={"column": "episode_index", "equal": 7})
    with pytest.raises(ConfigurationError, match=r"rows.column: .*its columns are action, obs"):
        mapped(source, rows={"column": "episode", "equal": 1})
    with pytest.raises(ConfigurationError, match="give column and equal, or neither"):
        mapped(source, rows={"equal": 1})
    with pytest.raises(DataError, match="'task' does not hold numbers"):
        mapped(source, position={"columns": ["task", "timestamp", "timestamp"]})


def test_files_that_are_no_tables(tmp_path: Path) -> None:
    source = tmp_path / "broken.parquet"
    source.write_bytes(b"PAR1 but not really PAR1")
    with pytest.raises(DataError, match="is not a readable Parquet table"):
        mapped(source)
    rows = pa.array([[1.0], [1.0, 2.0]])
    pq.write_table(pa.table({"action": rows, "observation.state": rows}), source)
    with pytest.raises(DataError, match=r"'action' have lengths \[1, 2\], not one"):
        mapped(source, rows=None, time={"rate_hz": 30})


@pytest.mark.parametrize("write", [str, lambda row: str(list(row))])
def test_the_same_as_text(tmp_path: Path, write: Any) -> None:
    lines = ["timestamp,episode_index,action,observation.state"]
    lines += [
        f'{k % 30 / 30!r},{k // 30},"{write(a)}","{write(q)}"'
        for k, (a, q) in enumerate(zip(ACTION.astype(float), STATE.astype(float), strict=True))
    ]
    source = tmp_path / "frames.csv"
    source.write_text("\n".join(lines).replace("np.float64(", "").replace(")", "") + "\n")
    found = mapped(source)
    np.testing.assert_allclose(found.q, np.radians(STATE[30:], dtype=float), atol=1e-8)
    np.testing.assert_allclose(found.command.q, np.radians(ACTION[30:], dtype=float), atol=1e-8)
    source.write_text(source.read_text() + '0.5,1,"[1, 2, 3]","[1, 2]"\n')
    with pytest.raises(DataError, match=r"'observation.state': not a vector of 3 numbers"):
        mapped(source)
