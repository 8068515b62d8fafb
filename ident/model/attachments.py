"""The files that travel inside a log: configuration, robot, trajectory."""

from typing import Any, Protocol

import yaml

from wamctl.arm.config import ArmFile, RobotFile, validate
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.trajectory import TrajectoryFile

_CONFIG, _URDF, _TRAJECTORY = "config.yaml", "robot.urdf", "trajectory.yaml"


class HasAttachments(Protocol):
    """Anything an arm's files can travel in: a recording, or the summary of one."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Its joints."""
        ...

    @property
    def attachments(self) -> dict[str, bytes]:
        """The files by name."""
        ...


def carries_urdf(carrier: HasAttachments) -> bool:
    """Whether an arm's URDF travels inside the log."""
    return _URDF in carrier.attachments


def attached_urdf(carrier: HasAttachments, log: str) -> tuple[str, str]:
    """The URDF inside a log, and the words that say where it was found.

    Raises:
        DataError: the log carries none.
    """
    if _URDF not in carrier.attachments:
        raise DataError(f"{log} carries no {_URDF}: name the arm with --robot FILE.yaml or .urdf.")
    return carrier.attachments[_URDF].decode("utf-8", errors="replace"), f"{log}:{_URDF}"


def attached_config(carrier: HasAttachments, log: str) -> RobotFile | ArmFile | None:
    """The arm's configuration inside a log; None where there is none.

    Raises:
        ConfigurationError: it is invalid.
    """
    if _CONFIG not in carrier.attachments:
        return None
    source = config_source(log)
    content = _content(carrier.attachments[_CONFIG], source)
    full = isinstance(content, dict) and "drives" in content
    return validate(ArmFile if full else RobotFile, content, source)


def config_source(log: str) -> str:
    """The words that say where a log's configuration was found."""
    return f"{log}:{_CONFIG}"


def attached_trajectory(carrier: HasAttachments, log: str) -> TrajectoryFile | None:
    """The excitation inside a log; None where there is none.

    Raises:
        ConfigurationError: it is invalid.
    """
    if _TRAJECTORY not in carrier.attachments:
        return None
    source = f"{log}:{_TRAJECTORY}"
    return validate(TrajectoryFile, _content(carrier.attachments[_TRAJECTORY], source), source)


def _content(text: bytes, source: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError(source, [f"not valid YAML ({error})"]) from error
