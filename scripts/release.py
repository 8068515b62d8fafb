"""The version, and the notes of its release, from the git tag and the changelog.

Usage: python scripts/release.py     prints the notes of the release
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_SECTION = r"^## \[{}\] - \d{{4}}-\d\d-\d\d\n(.*?)(?=^## \[|\Z)"


def version(root: Path = ROOT) -> str:
    """That of the newest tag vX.Y.Z before this commit; without one, the changelog's newest."""
    if (root / ".git").exists():
        words = ["git", "describe", "--tags", "--abbrev=0", "--match", "v[0-9]*"]
        told = subprocess.run(words, cwd=root, capture_output=True, text=True, check=False)
        if told.returncode == 0:
            return told.stdout.strip().removeprefix("v")
    newest = re.search(r"^## \[(\d[^\]]*)\]", (root / "CHANGELOG.md").read_text("utf-8"), re.M)
    if newest is None:
        sys.exit("CHANGELOG.md has no section of a version: add one, '## [X.Y.Z] - YYYY-MM-DD'.")
    return newest[1]


def notes(root: Path = ROOT) -> str:
    """The changelog's section of the version, which CITATION.cff names too."""
    name = version(root)
    text = (root / "CHANGELOG.md").read_text("utf-8")
    section = re.search(_SECTION.format(re.escape(name)), text, re.M | re.S)
    if section is None:
        sys.exit(f"CHANGELOG.md has no section '## [{name}] - YYYY-MM-DD': write it, and tag anew.")
    if f"\nversion: {name}\n" not in (root / "CITATION.cff").read_text("utf-8"):
        sys.exit(f"CITATION.cff names another version than {name}: change it, and tag anew.")
    return section[1].strip() + "\n"


if __name__ == "__main__":
    sys.stdout.write(notes())
