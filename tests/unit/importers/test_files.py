"""Files that hold no table, and text in the encoding that other programs choose."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from ident.importers.recording import mapped_recording
from wamctl.arm.errors import DataError

PLAN: dict[str, Any] = {
    "joints": ["a"],
    "time": {"rate_hz": 100},
    "position": {"columns": ["q"]},
    "effort": {"columns": ["u"]},
}
NUMBERED: dict[str, Any] = {
    "header": False, "position": {"columns": [1]}, "effort": {"columns": [2]},
}  # fmt: skip
TEXT = "q,u\n" + "\n".join(f"{k / 7},{k}" for k in range(5)) + "\n"


def mapped(source: Path, content: bytes, **changes: Any) -> Any:
    source.write_bytes(content)
    where = source.parent / "map.yaml"
    where.write_text(yaml.safe_dump(PLAN | changes))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return mapped_recording(source, where)


@pytest.mark.parametrize(
    ("name", "content", "changes", "sentence"),
    [
        ("data.csv", b"", {}, "is empty: give a table with rows."),
        ("data.mat", b"", {}, "is empty: give a table with rows."),
        ("data.csv", b"q,u\n", {}, "has no rows below its header: give a table with rows."),
        ("data.csv", b"q,u", {}, "has no rows below its header: give a table with rows."),
        ("data.csv", b"\n\n", NUMBERED, "has no rows of numbers: give a table with rows."),
        ("data.xlsx", b"PK\x03\x04", {}, "is a workbook of a spreadsheet: save its sheet as CSV."),
    ],
)
def test_a_file_without_a_table_is_told_in_one_sentence(
    tmp_path: Path, name: str, content: bytes, changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(DataError) as caught:
        mapped(tmp_path / name, content, **changes)
    assert str(caught.value) == f"{tmp_path / name} {sentence}"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be"])
@pytest.mark.parametrize("delimiter", [",", "\t"])
def test_the_first_bytes_tell_the_encoding(tmp_path: Path, encoding: str, delimiter: str) -> None:
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    content = mark + TEXT.replace(",", delimiter).encode(encoding)
    found = mapped(tmp_path / "data.csv", content)
    np.testing.assert_array_equal(found.q[:, 0], np.arange(5) / 7)


def test_a_file_that_is_cut_within_a_character_is_told(tmp_path: Path) -> None:
    long = TEXT + "0.5,0.5\n" * 50_000
    cut = long.encode("utf-16")[:-1]
    for content in (cut, long.encode() + b"0.5,\xb0\n", b"\xff\xfe" + b"\x00\xdc" * 20):
        with pytest.raises(DataError) as caught:
            mapped(tmp_path / "data.csv", content)
        assert str(caught.value).startswith(f"{tmp_path / 'data.csv'} is not a readable text")


def test_blank_lines_before_the_last_row_give_no_warning(tmp_path: Path) -> None:
    content = TEXT.replace("\n", "\n\n").encode()
    assert len(mapped(tmp_path / "data.csv", content, rows={"last": 3}).q) == 3
