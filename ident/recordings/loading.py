"""Logs on disk, joined with their arm, and laid out as datasets."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from ident.model.arm import Arm, all_joints, arm_from_file, arm_from_log
from ident.model.attachments import HasAttachments
from ident.recordings.dataset import Dataset, dataset_of, kept
from ident.recordings.errors import ArmsDifferError
from ident.recordings.joint_names import Pairs, renamed
from ident.recordings.log_summary import LogSummary, summarise_log
from ident.recordings.samples import TorqueSource
from ident.recordings.steady_state import only_steady_state
from wamctl.arm.recording import JOINT_COMMANDS, JOINT_STATES, LogFile
from wamctl.arm.ros2.joint_groups import joint_groups


@dataclass(frozen=True)
class Reading:
    """What to read of a log.

    Attributes:
        joint_states, joint_commands: names of the topics.
        torque: which torque to use; None: the commanded one where there is one.
        rules: parts of joint names, and what they are to be replaced by.
    """

    joint_states: str = JOINT_STATES
    joint_commands: str = JOINT_COMMANDS
    torque: TorqueSource | None = None
    rules: tuple[tuple[str, str], ...] = ()


def read_logs(
    paths: Sequence[Path], robot: Path | None, reading: Reading
) -> tuple[Arm, list[Dataset]]:
    """The arm and its recordings.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        reading: what to read.

    Raises:
        DataError: a log that cannot be used, or logs of different arms.
        ConfigurationError: a robot file that cannot be used.
    """
    surveys = [_survey(path, reading, *joints_to_read(path, robot, reading)) for path in paths]
    arm = arm_of(surveys, paths, robot)
    return arm, [dataset_for(arm, found, reading.torque) for found in surveys]


def read_for(arm: Arm, path: Path, reading: Reading) -> Dataset:
    """One recording of an arm that is known already.

    Raises:
        DataError: a log that cannot be used.
    """
    joints = arm.robot.joint_names
    names = tuple(chain.from_iterable(joint_groups(path, reading.joint_states)))
    pairs = renamed(names, joints, reading.rules)
    return dataset_for(arm, _survey(path, reading, joints, pairs), reading.torque)


def joints_to_read(
    path: Path, robot: Path | None, reading: Reading
) -> tuple[tuple[str, ...], Pairs]:
    """Joints whose messages are the arm's, and joints that are named otherwise than the arm's.

    Joints are empty where all messages are of one driver: all of them are read then.

    Args:
        path: the log.
        robot: file that describes the arm, if one is given.
        reading: what to read.

    Raises:
        DataError: a log that cannot be used.
        ConfigurationError: a robot file that cannot be used, or without any of these joints.
    """
    if robot is None and not reading.rules:
        return (), ()
    groups = joint_groups(path, reading.joint_states)
    names = tuple(chain.from_iterable(groups))
    pairs = renamed(names, () if robot is None else all_joints(robot), reading.rules)
    if robot is None or len(groups) < 2:
        return (), pairs
    as_arm = dict(pairs)
    groups = [tuple(as_arm.get(n, n) for n in group) for group in groups]
    of_arm = arm_from_file(robot, tuple(chain.from_iterable(groups))).robot.joint_names
    most = max(groups, key=lambda group: len(set(group) & set(of_arm)))
    return tuple(j for j in most if j in of_arm), pairs


def commanded_joints(
    path: Path, robot: Path | None, reading: Reading
) -> tuple[tuple[str, ...], Pairs]:
    """The same without joints that get no commands, where others do.

    A gripper has often a controller of its own, and its positions among the arm's.
    """
    joints, pairs = joints_to_read(path, robot, reading)
    as_arm = dict(pairs)
    told, asked = (
        [as_arm.get(n, n) for group in joint_groups(path, topic) for n in group]
        for topic in (reading.joint_states, reading.joint_commands)
    )
    told = list(joints) or told
    kept = tuple(n for n in told if n in asked)
    return (kept, pairs) if kept and len(kept) < len(told) else (joints, pairs)


def _survey(path: Path, reading: Reading, joints: tuple[str, ...], pairs: Pairs) -> LogSummary:
    file = LogFile(path, reading.joint_states, reading.joint_commands, joints, pairs)
    return summarise_log(file, str(path))


def dataset_for(arm: Arm, found: LogSummary, torque: TorqueSource | None = None) -> Dataset:
    """The samples of a log on a uniform grid, joints in the robot's order, in steady state.

    Args:
        arm: the arm of the log.
        found: the log.
        torque: the one to use; None: the commanded one where there is one.

    Raises:
        DataError: joints or torque that cannot be used.
    """
    data = kept(dataset_of(found, arm.robot.joint_names, torque, arm.robot.sliding.tolist()))
    if arm.unrecorded:
        fact = (
            f"joints of the URDF, but not recorded, so locked at zero: {', '.join(arm.unrecorded)}"
        )
        data = replace(data, facts=(*data.facts, fact))
    return only_steady_state(data, found, found.name)


def arm_of(logs: Sequence[HasAttachments], paths: Sequence[Path], robot: Path | None) -> Arm:
    """The arm that all logs belong to: of the robot file, or of what travels inside them.

    Raises:
        DataError: logs of different arms, or without one.
        ConfigurationError: a robot file that cannot be used.
    """
    if robot is not None:
        return arm_from_file(robot, logs[0].joint_names)
    arms = [arm_from_log(log, str(p)) for log, p in zip(logs, paths, strict=True)]
    for arm, path in zip(arms, paths, strict=True):
        if arm.robot.urdf != arms[0].robot.urdf:
            raise ArmsDifferError(str(paths[0]), str(path))
    return arms[0]


def fingerprint(path: Path) -> str:
    """SHA-256 of a log's bytes; of all files of a folder, in the order of their names."""
    digest = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
