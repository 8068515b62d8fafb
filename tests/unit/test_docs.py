"""The documentation builds without a warning, and what is generated in it is up to date."""

import runpy
import subprocess
import sys
import tomllib
from pathlib import Path

import yaml

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


def test_the_settings_page_is_that_of_the_models() -> None:
    made = runpy.run_path(str(PROJECT / "scripts/docs"))
    page, advice = made["settings_page"](), "run scripts/docs --settings"
    assert (PROJECT / "docs/settings.md").read_text("utf-8") == page, advice
    for kind in made["SCHEMAS"]:
        path = PROJECT / f"configs/schema/{kind}.schema.json"
        assert path.read_text("utf-8") == made["schema"](kind), advice


def test_one_version_everywhere() -> None:
    version = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert yaml.safe_load((PROJECT / "CITATION.cff").read_text("utf-8"))["version"] == version
    assert f"\n## [{version}] - " in (PROJECT / "CHANGELOG.md").read_text("utf-8")


def test_the_readme_is_one_screen() -> None:
    assert len((PROJECT / "README.md").read_text("utf-8").split()) <= 900
