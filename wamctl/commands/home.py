"""The arm's zero, found with the operator's hands (`wamctl home`)."""

from collections.abc import Callable

import numpy as np

from wamctl.arm.errors import ConfigurationError
from wamctl.experiment.session import Setup, connected


def home(setup: Setup, ask: Callable[[str], None]) -> list[str]:
    """Declare where the motors stand, with the arm held in its home pose; no torque is given.

    Args:
        setup: which arm.
        ask: shows the operator what to do, and returns when he has done it.

    Returns:
        what remains for the operator to do.

    Raises:
        UserError: no home pose is configured, or the drives do not answer or take it.
    """
    pose = setup.arm.file.drives.home_pose_rad
    if pose is None:
        raise ConfigurationError(setup.path, ["drives.home_pose_rad: unset, so there is no home"])
    with connected(setup, zeroed=False) as connection:
        ask(_instruction(setup, pose))
        return connection.drives.define(setup.arm.transmission.motor_angle(np.array(pose)))


def _instruction(setup: Setup, pose: tuple[float, ...]) -> str:
    joints = "\n".join(
        f"  {name}: {q:+.3f} rad ({np.degrees(q):+.1f} deg)"
        for name, q in zip(setup.arm.robot.joint_names, pose, strict=True)
    )
    return (
        f"The drives of {setup.arm.file.arm} give no torque. Move the arm by hand to its home pose"
        f" and hold it there:\n{joints}\nPress Enter when it rests there"
    )
