"""Where a log comes from: what travels inside it beside the measurements."""

import importlib.metadata
import platform
from collections.abc import Mapping

import yaml

from wamctl.arm.command_line import git_commit
from wamctl.arm.trajectory import Trajectory, trajectory_yaml
from wamctl.drives.bus import EMBEDDED, Channel
from wamctl.experiment.session import Setup

_LIBRARIES = ("wam-ident", "numpy", "pin", "python-can", "canopen")


def metadata(setup: Setup, channel: Channel) -> dict[str, str]:
    """Facts about a run of a setup, on a bus."""
    file = setup.arm.file
    versions = {f"version.{name}": importlib.metadata.version(name) for name in _LIBRARIES}
    facts = {
        "arm": file.arm,
        "bus": EMBEDDED if setup.is_embedded else str(channel),
        "clock": "lockstep" if setup.lockstep else "real time",
        "period_s": repr(file.bus.period_s),
        "protocol": file.drives.protocol,
        "git_commit": git_commit(),
        "version.python": platform.python_version(),
    }
    if setup.is_embedded:
        facts["seed"] = str(setup.seed)
    return facts | versions


def attachments(setup: Setup, trajectory: Trajectory) -> Mapping[str, bytes]:
    """The files that describe a run; `ident run` needs no others."""
    return {
        "config.yaml": _resolved(setup).encode(),
        "robot.urdf": setup.arm.robot.urdf.encode(),
        "trajectory.yaml": trajectory_yaml(trajectory).encode(),
    }


def _resolved(setup: Setup) -> str:
    """The configuration with every default spelt out."""
    return yaml.safe_dump(setup.arm.file.model_dump(mode="json"), sort_keys=False, width=100)
