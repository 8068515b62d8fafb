"""Where a result comes from: program, libraries, arm, logs, and settings."""

import importlib.metadata
import platform
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ident.model.arm import Arm
from ident.recordings.loading import fingerprint

_LIBRARIES = ("numpy", "scipy", "pin", "clarabel")


def provenance(arm: Arm, paths: Sequence[Path]) -> dict[str, Any]:
    """Facts for a result file.

    Args:
        arm: robot and settings.
        paths: the logs.
    """
    return {
        "program": {
            "wam-ident": importlib.metadata.version("wam-ident"),
            "commit": git_commit(),
            "python": platform.python_version(),
        }
        | {name: importlib.metadata.version(name) for name in _LIBRARIES},
        "arm": {"name": arm.name, "described in": arm.source},
        "logs": {str(path): fingerprint(path) for path in paths},
        "settings": arm.settings.model_dump(mode="json"),
    }


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
        timeout=10,
    )
    return done.stdout.strip()
