"""The commit that the program was installed from."""

import subprocess
from pathlib import Path

_WAIT_S = 10


def git_commit() -> str:
    """Commit of the source tree, with `+changes` where it differs; `unknown` outside of one."""
    try:
        _git("ls-files", "--error-unmatch", Path(__file__).name)
        commit = _git("rev-parse", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit}+changes" if changed else commit


def _git(*arguments: str) -> str:
    done = subprocess.run(
        ["git", *arguments],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=True,
        timeout=_WAIT_S,
    )
    return done.stdout.strip()
