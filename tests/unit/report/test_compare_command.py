"""`ident report compare`: from folders to a page, and what it refuses."""

import json
from pathlib import Path
from typing import Any

import pytest

from ident.cli import main


def call(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    return int(ended.value.code or 0)


@pytest.fixture
def folders(tmp_path: Path, run_content: dict[str, Any]) -> list[Path]:
    made = [tmp_path / "monday", tmp_path / "friday"]
    for folder in made:
        folder.mkdir()
        (folder / "run.json").write_text(json.dumps(run_content))
    return made


def test_two_runs_become_a_page(folders: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    out = folders[0].parent / "compare.html"
    assert call("report", "compare", *folders, "--out", out) == 0
    assert "monday and friday" in out.read_text()
    assert capsys.readouterr().out.splitlines() == [
        "No base parameter of the two runs differs by more than 3 combined standard errors.",
        str(out),
    ]


def test_the_comparison_is_json_as_well(
    folders: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = folders[0].parent / "compare.html"
    assert call("report", "compare", *folders, "--out", out, "--json") == 0
    content = json.loads(capsys.readouterr().out)
    assert [run["name"] for run in content["runs"]] == ["monday", "friday"]
    assert [p["apart"] for p in content["base_parameters"]] == [0.0, 0.0]


def test_what_is_no_run_is_refused(
    folders: list[Path], run_content: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = folders
    path = second / "run.json"
    path.write_text(json.dumps(run_content | {"joints": ["other"]}))
    assert call("report", "compare", first, second) == 6
    assert "only runs of arms with the same joints compare" in capsys.readouterr().err
    path.write_text("{")
    assert call("report", "compare", first, second) == 6
    assert "is no JSON" in capsys.readouterr().err
    path.unlink()
    assert call("report", "compare", first, second) == 6
    assert "give two result folders of `ident run`" in capsys.readouterr().err


def test_a_kind_that_is_none_is_a_usage_error(folders: list[Path]) -> None:
    assert call("report", "contrast", *folders) == 2
