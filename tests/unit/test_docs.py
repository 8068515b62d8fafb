"""The documentation builds without a warning, and what is generated in it is up to date."""

import importlib.metadata
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


def test_the_site_builds_without_a_warning(tmp_path) -> None:
    done = subprocess.run(
        [sys.executable, PROJECT / "scripts/docs", tmp_path / "site"],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin", "NO_MKDOCS_2_WARNING": "1"},
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site/docs/quick-start/index.html").read_text(encoding="utf-8")
    assert "ident gap bag.mcap" in page
    reference = (tmp_path / "site/docs/api/index.html").read_text(encoding="utf-8")
    assert all(f"Model.{name}" in reference for name in ("inverse_dynamics", "regressor", "save"))


def test_the_settings_page_is_that_of_the_models() -> None:
    made = runpy.run_path(str(PROJECT / "scripts/docs"))
    page, advice = made["settings_page"](), "run scripts/docs --settings"
    assert (PROJECT / "docs/settings.md").read_text("utf-8") == page, advice
    for kind in made["SCHEMAS"]:
        path = PROJECT / f"configs/schema/{kind}.schema.json"
        assert path.read_text("utf-8") == made["schema"](kind), advice


def test_the_version_and_its_notes_are_those_of_the_tag(tmp_path) -> None:
    made = runpy.run_path(str(PROJECT / "scripts/release.py"))
    version, notes = made["version"], made["notes"]
    assert notes().strip()
    assert importlib.metadata.version("wam-ident") == version()
    (tmp_path / "CITATION.cff").write_text("title: x\nversion: 1.2.0\n", "utf-8")
    changes = "## [Unreleased]\n\n## [1.2.0] - 2026-01-02\n\n- New.\n\n## [1.1.0] - 2026-01-01\n"
    (tmp_path / "CHANGELOG.md").write_text(changes, "utf-8")
    assert (version(tmp_path), notes(tmp_path)) == ("1.2.0", "- New.\n")
    named = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init"], [*named, "commit", "--allow-empty", "-m", "x"], ["tag", "v1.3.0"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True, capture_output=True)
    assert version(tmp_path) == "1.3.0"
    with pytest.raises(SystemExit, match=r"no section '## \[1\.3\.0\]"):
        notes(tmp_path)


def test_the_readme_is_one_screen() -> None:
    assert len((PROJECT / "README.md").read_text("utf-8").split()) < 900
