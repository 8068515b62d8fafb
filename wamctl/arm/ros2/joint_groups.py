"""Whose joints come on a topic: often several drivers, an arm's and a gripper's, share one."""

from pathlib import Path

from wamctl.arm.ros2.bag import parts
from wamctl.arm.ros2.joint_messages import JOINT_STATE_TYPE, joint_series
from wamctl.arm.ros2.part import Batch, Topic

_ENOUGH = 2000
"""Messages after which every driver has spoken."""


def joint_groups(path: Path, topic: str) -> list[tuple[str, ...]]:
    """The joints that messages at the beginning of a bag name together, one entry per driver.

    Args:
        path: the bag.
        topic: of joint states.

    Raises:
        DataError: no bag, or a message that is damaged.
    """
    groups: dict[frozenset[str], tuple[str, ...]] = {}
    seen = 0
    for part in parts(path, {topic}):
        if isinstance(part, Topic) and part.name == topic:
            if (part.type, part.encoding) != (JOINT_STATE_TYPE, "cdr"):
                return []
        elif isinstance(part, Batch) and topic in part.messages:
            for block in joint_series(part.messages[topic], part.log_ns[topic]):
                groups.setdefault(frozenset(block.joint_names), block.joint_names)
            seen += len(part.messages[topic])
            if seen >= _ENOUGH:
                break
    return list(groups.values())
