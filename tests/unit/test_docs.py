"""The documentation builds without a warning, and what is generated in it is up to date."""

import runpy
import subprocess
import sys
from pathlib import Path

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
    page = runpy.run_path(str(PROJECT / "scripts/docs"))["settings_page"]()
    assert (PROJECT / "docs/settings.md").read_text("utf-8") == page, "run scripts/docs --settings"


def test_the_readme_is_one_screen() -> None:
    assert len((PROJECT / "README.md").read_text("utf-8").split()) <= 900
