"""The notebooks run, on one recording, and say what their texts promise."""

import json
import runpy
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
NOTEBOOKS = sorted((PROJECT / "docs/notebooks").glob("*.ipynb"))
RUN = runpy.run_path(str(PROJECT / "scripts/notebooks"), run_name="notebooks")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("notebooks")


def executed(path: Path) -> dict[str, object]:
    return RUN["execute"](json.loads(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path: Path, folder: Path, monkeypatch) -> None:
    monkeypatch.chdir(folder)
    names = executed(path)
    if path.stem == "gap-named":
        gap = names["gap"]
        assert [(e.name, e.joints) for e in gap.effects] == [
            ("stribeck", ("wam/elbow_pitch_joint",))
        ]
    else:
        fits = names.get("fits", [names.get("fit")])
        assert all(fit.verdict == "trustworthy" for fit in fits)


def test_all_have_been_executed() -> None:
    assert len(NOTEBOOKS) == 3
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert all(c["execution_count"] for c in cells if c["cell_type"] == "code")
        assert any(c.get("outputs") for c in cells)
