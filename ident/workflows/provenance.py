"""Where a result comes from: program, libraries, arm, logs, and settings."""

import importlib.metadata
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ident.model.arm import Arm
from ident.recordings.loading import fingerprint
from wamctl.arm.command_line import git_commit

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
