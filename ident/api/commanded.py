"""Recordings of commands and positions, for the work by simulation."""

from collections.abc import Sequence

from ident.api.arm import Arm
from ident.api.recording import Recording
from ident.model.arm import Arm as ArmModel
from ident.output_error.fit import MotionSegment
from ident.output_error.recordings import segments_of


def commanded(arm: Arm, recordings: Sequence[Recording]) -> tuple[ArmModel, list[MotionSegment]]:
    """The arm in the order of the recordings' joints, and their segments with commands.

    Raises:
        DataError: a recording without commanded positions.
    """
    known = arm.of_recording(recordings[0].log.joint_names)
    names = known.robot.joint_names
    return known, [s for r in recordings for s in segments_of(r.log, names, r.name)]
