"""A simulated run as the recording that the driver would have made of it."""

import numpy as np

from ident.simulation.loop import Run
from wamctl.arm.recording import Command, Recording
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Reference


def recorded(
    joint_names: tuple[str, ...],
    motion: Reference,
    made: Run,
    attachments: dict[str, bytes],
    metadata: dict[str, str],
) -> Recording:
    """Positions beside the commanded torque and the wanted motion.

    Args:
        joint_names: n names.
        motion: what was wanted, S samples of n joints.
        made: what came of it.
        attachments: files inside the log.
        metadata: facts about the run.
    """
    stamps = np.round(motion.t * 1e9).astype(np.int64)
    return Recording(
        joint_names=joint_names,
        stamp_ns=stamps,
        q=made.q,
        qd=None,
        effort=None,
        command=Command(stamps, motion.q, motion.qd, made.tau_cmd),
        reference=ReferenceSeries(stamps, motion.q, motion.qd, motion.qdd),
        metadata=metadata,
        attachments=attachments,
    )
