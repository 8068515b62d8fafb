"""The notebooks run, on one short recording, and say what their texts promise."""

import json
import runpy
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from wamctl.arm.config import shipped_file
from wamctl.arm.trajectory import read_trajectory, write_trajectory

PROJECT = Path(__file__).parents[2]
NOTEBOOKS = sorted((PROJECT / "docs/notebooks").glob("*.ipynb"))
RUN = runpy.run_path(str(PROJECT / "scripts/notebooks"), run_name="notebooks")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder whose `wam7.yaml` hides the shipped one: its motion has one period, not three."""
    folder = tmp_path_factory.mktemp("notebooks")
    content = yaml.safe_load(shipped_file("wam7.yaml").read_text("utf-8"))
    content["robot"]["urdf"] = str(shipped_file("wam7.urdf"))
    content["drives"]["dictionary"] = str(shipped_file("puck4.eds"))
    content["excitation"]["trajectory"] = "once.yaml"
    once = replace(read_trajectory("wam7-excitation.yaml"), periods=1)
    write_trajectory(folder / "once.yaml", once)
    (folder / "wam7.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return folder


def executed(path: Path) -> dict[str, object]:
    return RUN["execute"](json.loads(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(p, id=p.stem, marks=[] if p.stem == "sweep" else pytest.mark.thorough)
        for p in NOTEBOOKS
    ],
)
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
