"""Whose joints come on a topic: often several drivers, an arm's and a gripper's, share one."""

from pathlib import Path

from wamctl.arm.ros2.bag import parts
from wamctl.arm.ros2.joint_messages import JOINT_STATE_TYPE, decoded, joint_series
from wamctl.arm.ros2.joint_trajectory import TRAJECTORY_TYPE
from wamctl.arm.ros2.part import Batch, Topic

_ENOUGH = 2000
"""Messages after which every driver has spoken."""


def joint_groups(path: Path, topic: str) -> list[tuple[str, ...]]:
    """The joints that messages at the beginning of a bag name together, one entry per driver.

    Args:
        path: the bag.
        topic: of joint states, or of trajectories.

    Raises:
        DataError: no bag, or a message that is damaged.
    """
    groups: dict[frozenset[str], tuple[str, ...]] = {}
    seen, kind = 0, ""
    for part in parts(path, {topic}):
        if isinstance(part, Topic) and part.name == topic:
            kind = part.type
            if kind not in (JOINT_STATE_TYPE, TRAJECTORY_TYPE) or part.encoding != "cdr":
                return []
        elif isinstance(part, Batch) and topic in part.messages:
            for names in _named(part, topic, kind):
                groups.setdefault(frozenset(names), names)
            seen += len(part.messages[topic])
            if seen >= _ENOUGH:
                break
    return list(groups.values())


def _named(batch: Batch, topic: str, kind: str) -> list[tuple[str, ...]]:
    messages = batch.messages[topic]
    if kind == TRAJECTORY_TYPE:
        return [tuple(decoded(data, kind).joint_names) for data in messages]
    return [block.joint_names for block in joint_series(messages, batch.log_ns[topic])]
