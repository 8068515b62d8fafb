"""Logs of commanded and measured positions, joined with their arm."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.model.arm import Arm
from ident.output_error.recordings import segments_of
from ident.output_error.setup import MotionSegment
from ident.recordings.joint_names import renamed
from ident.recordings.loading import Reading, arm_of, commanded_joints
from wamctl.arm.recording import Recording, read_recording


def read_commanded(
    paths: Sequence[Path], robot: Path | None, reading: Reading
) -> tuple[Arm, tuple[MotionSegment, ...]]:
    """The arm, and what its joints were asked for and did.

    Raises:
        DataError: a log that cannot be used, or logs of different arms.
        ConfigurationError: a robot file that cannot be used.
    """
    logs = [_read(path, reading, *commanded_joints(path, robot, reading)) for path in paths]
    arm = arm_of(logs, paths, robot)
    return arm, _segments(arm, logs, [str(p) for p in paths])


def read_commanded_for(
    joint_names: tuple[str, ...], path: Path, reading: Reading
) -> tuple[MotionSegment, ...]:
    """The same of one log, of an arm that is known already."""
    log = _read(path, reading, (), ())
    pairs = renamed(log.joint_names, joint_names, reading.rules)
    if pairs:
        log = _read(path, reading, (), pairs)
    return segments_of(log, joint_names, str(path))


def read_remarks(arm: Arm, segments: Sequence[MotionSegment]) -> list[Remark]:
    """What is said of what was left out: joints, and samples."""
    return [*unrecorded_remarks(arm), *glitch_remarks(segments, arm.robot.joint_names)]


def glitch_remarks(segments: Sequence[MotionSegment], names: Sequence[str]) -> list[Remark]:
    """What is said of samples that were left out, recording by recording."""
    said = []
    for s in segments:
        places = np.flatnonzero(s.wrong)
        if len(places):
            text = (
                f"{s.name}: {sum(s.wrong)} positions that no motion reaches from their neighbours,"
                f" at {joints(places, names)}, were left out; others may be wrong without showing."
            )
            advice = "Check the cables, the bus and the recorder."
            said.append(Remark("glitches", numbers(places), text, Grade.DOUBTFUL, advice))
    return said


def unrecorded_remarks(arm: Arm) -> list[Remark]:
    """What is said of joints of the URDF that no command or no position names."""
    if not arm.unrecorded:
        return []
    text = (
        "Joints of the URDF without commands or positions in the recordings were taken to stand at"
        f" zero: {joined(arm.unrecorded)}."
    )
    return [Remark("commands", (), text, Grade.TRUSTWORTHY)]


def _read(path: Path, reading: Reading, joints: tuple[str, ...], pairs: tuple) -> Recording:
    return read_recording(
        path, reading.joint_states, reading.joint_commands, joints, pairs, torque=False
    )


def _segments(
    arm: Arm, logs: Sequence[Recording], names: Sequence[str]
) -> tuple[MotionSegment, ...]:
    found: list[MotionSegment] = []
    for log, name in zip(logs, names, strict=True):
        found += segments_of(log, arm.robot.joint_names, name)
    return tuple(found)
