"""A column that a mapping names twice is a slip, wherever it stands and however it is called."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from ident.importers.recording import mapped_recording
from wamctl.arm.errors import ConfigurationError, DataError

ROWS = np.random.default_rng(0).normal(size=(20, 7))
NAMES = ["t", "q1", "q2", "q3", "u1", "u2", "u3"]
BASIC: dict[str, Any] = {
    "joints": ["a", "b", "c"],
    "time": {"rate_hz": 100},
    "position": {"columns": ["q1", "q2", "q3"]},
    "effort": {"columns": ["u1", "u2", "u3"]},
}


def mapped(folder: Path, changes: dict[str, Any], rows: Any = ROWS, names: Any = NAMES) -> Any:
    lines = [",".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    np.savez(folder / "data.npz", pos=ROWS[:, 1:4], tau=ROWS[:, 4:])
    (folder / "map.yaml").write_text(yaml.safe_dump(BASIC | changes))
    array = isinstance((BASIC | changes)["position"]["columns"], str)
    source = folder / ("data.npz" if array else "data.csv")
    return mapped_recording(source, folder / "map.yaml")


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        (
            {"position": {"columns": ["q1", "q2", "q1"]}},
            "position.columns: 'q1' is given for a and c; each joint has a column of its own",
        ),
        (
            {"effort": {"columns": ["u1", 6, "u2"], "file": "data.csv"}},
            "effort.columns: column 6 is given for b and c; each joint has a column of its own",
        ),
        (
            {
                "effort": {"columns": ["u1", "u2", "u2"], "side": "motor"},
                "motor_from_joint": np.eye(3).tolist(),
            },
            "effort.columns: 'u2' is given for motor 2 and motor 3; each joint has a column of its"
            " own",
        ),
        (
            {"effort": BASIC["position"]},
            "effort.columns: 'q1' (a), 'q2' (b), 'q3' (c) stand under position as well; each"
            " quantity has columns of its own",
        ),
        (
            {"time": {"column": "t"}, "effort": {"columns": ["t", "u2", "u3"]}},
            "effort.columns: 't' (a) stands under time as well; each quantity has columns of its"
            " own",
        ),
        (
            {"position": {"columns": "pos"}, "effort": {"columns": "pos"}},
            "effort.columns: 'pos' (a, b, c) stands under position as well; each quantity has"
            " columns of its own",
        ),
        (
            {"position": {"columns": "pos", "entries": [1, 2, 1]}, "effort": {"columns": "tau"}},
            "position.columns: column 1 of 'pos' is given for a and c; each joint has a column of"
            " its own",
        ),
    ],
    ids=["joints", "number", "motors", "quantities", "time", "array", "entries"],
)
def test_a_column_named_twice_is_refused(
    tmp_path: Path, changes: dict[str, Any], fault: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        mapped(tmp_path, changes)
    assert caught.value.faults == [fault]


def test_a_column_that_never_changes_serves_all_joints_that_are_held(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[:, 2] = 0.0
    found = mapped(tmp_path, {"position": {"columns": ["q1", "q2", "q2"]}}, rows)
    np.testing.assert_array_equal(found.q[:, 1:], 0.0)


def test_more_columns_than_joints_are_told_as_that(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        mapped(tmp_path, {"joints": ["a", "b"]})
    assert all("3 entries for 2 joints" in fault for fault in caught.value.faults)
    with pytest.raises(ConfigurationError) as caught:
        mapped(tmp_path, {"joints": [], "robot": "xmate7p.yaml"})
    assert all("3 entries for 7 joints" in fault for fault in caught.value.faults)


def test_a_name_that_two_columns_have_tells_none_of_them(tmp_path: Path) -> None:
    names = ["t", "q1", "q2", "q3", "u1", "u2", "q2"]
    numbered = {"effort": {"columns": [5, 6, 7]}}
    with pytest.raises(DataError) as caught:
        mapped(tmp_path, numbered, names=names)
    assert str(caught.value) == (
        f"{tmp_path / 'data.csv'}: the columns 3 and 7 are both called 'q2': write the number of"
        " the one that is meant, or rename them."
    )
    found = mapped(tmp_path, numbered | {"position": {"columns": ["q1", 3, "q3"]}}, names=names)
    np.testing.assert_array_equal(found.q[:, 1], ROWS[:, 2])
