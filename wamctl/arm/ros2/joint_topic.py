"""The joint messages of one topic: the same joints, the same columns, and finite, throughout."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.joint_series import JointSeries, columns_of, joined
from wamctl.arm.ros2.magnitudes import POSITION, TORQUE, excess

_COLUMNS = {"q": "positions", "qd": "velocities", "effort": "efforts"}
_BOUNDED = (("q", "position", POSITION), ("effort", "effort", TORQUE))


class JointTopic:
    """What has been taken of a topic so far.

    Args:
        where: what to call it in messages.
        joints: the joints to take, in this order; messages without them are passed over. Empty:
            those of the first message, which all others must have too.
    """

    def __init__(self, where: str, joints: tuple[str, ...]) -> None:
        self._where = where
        self._strict = not joints
        self.joints = joints
        self.carries: frozenset[str] = frozenset()
        self.seen = False
        self.stranger = ""

    def taken(self, blocks: Sequence[JointSeries]) -> JointSeries | None:
        """The next blocks as one series; None where no message has the joints.

        Raises:
            DataError: other joints or other columns than before, or numbers that are not finite or
                beyond all measure.
        """
        found = [self._cleaned(columns_of(b, self.joints)) for b in blocks if self._fits(b)]
        return joined(found) if found else None

    def _fits(self, block: JointSeries) -> bool:
        names = block.joint_names
        self.joints = self.joints or names
        if self._strict and set(names) != set(self.joints):
            raise DataError(
                f"{self._where} changes its joints at {block.stamp_ns[0]} ns, from"
                f" {', '.join(self.joints)} to {', '.join(names)}: name the arm's joints with"
                " --robot."
            )
        missing = ", ".join(repr(j) for j in self.joints if j not in names)
        if missing and not self.stranger:
            self.stranger = f"{self._where} has no joint {missing}; its joints are"
            self.stranger += f" {', '.join(names)}."
        return not missing

    def _cleaned(self, block: JointSeries) -> JointSeries:
        """The block; a column is None where a driver fills it with NaN because it has none."""
        nothing = {}
        for name, what in _COLUMNS.items():
            column = getattr(block, name)
            if column is None or np.isfinite(column).all():
                continue
            bad = ~np.isfinite(column)
            if not bad.all():
                sample, joint = np.argwhere(bad)[0]
                raise DataError(
                    f"{self._where}: {what} of {block.joint_names[joint]} are not finite at"
                    f" {block.stamp_ns[sample]} ns."
                )
            nothing[name] = None
        block = replace(block, **nothing)
        self._bounded(block)
        carries = frozenset(w for name, w in _COLUMNS.items() if getattr(block, name) is not None)
        if self.seen and carries != self.carries:
            raise DataError(
                f"{self._where} carries {self._words(self.carries)} at first, and"
                f" {self._words(carries)} from {block.stamp_ns[0]} ns on: cut the recording there."
            )
        self.seen, self.carries = True, carries
        return block

    def _bounded(self, block: JointSeries) -> None:
        for name, what, most in _BOUNDED:
            column = getattr(block, name)
            if column is None:
                continue
            wrong = excess(column, most, block.joint_names, lambda s: f"at {block.stamp_ns[s]} ns")
            if wrong:
                raise DataError(f"{self._where}: {what} {wrong}")

    def _words(self, columns: frozenset[str]) -> str:
        return ", ".join(w for w in _COLUMNS.values() if w in columns) or "nothing"
