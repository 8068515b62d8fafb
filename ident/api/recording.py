"""A recording, from arrays or from a ROS 2 bag."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path

import numpy as np

from ident.recordings.joint_names import renamed
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import JOINT_COMMANDS, JOINT_STATES, Command, read_recording
from wamctl.arm.recording import Recording as Log
from wamctl.arm.ros2.magnitudes import POSITION, TORQUE, excess

_NS = 1e9


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Positions and torques of n joints at S instants.

    Attributes:
        t: instants [s], rising, shape (S,).
        q: joint positions [rad] ([m] of sliding joints), shape (S, n).
        tau: joint torques [N m] ([N] of sliding joints), shape (S, n); None where there are none.
        joints: names of the n joints, in the order of the columns.
        commanded: whether `tau` is the torque that was commanded (it acts from its instant to the
            next one), not a measured one.
        q_command: commanded positions from each instant on [rad], shape (S, n), for
            `identify(.., method="simulation")`; `tau` may then be left out.
        name: used in messages and reports.
        bag: the bag that it was read from, if any, with the wanted motion and the attached files; a
            copy with other arrays (`dataclasses.replace`) has none.

    Raises:
        DataError: arrays that do not fit together; the sentence says which, and how.
    """

    t: Array
    q: Array
    tau: Array | None = None
    joints: tuple[str, ...] = ()
    _: KW_ONLY
    commanded: bool = False
    q_command: Array | None = None
    name: str = "recording"
    bag: Log | None = None

    def __post_init__(self) -> None:
        for key in self._given():
            object.__setattr__(self, key, _numbers(getattr(self, key), f"{self.name}: {key}"))
        if not isinstance(self.joints, str):
            object.__setattr__(self, "joints", tuple(self.joints))
        if self.bag is not None and not self._is_as_read(self.bag):
            object.__setattr__(self, "bag", None)
        if self.bag is None:
            _check(self)

    def __repr__(self) -> str:
        """Name and size, without the arrays."""
        kinds = ", ".join(self._given())
        return f"<Recording {self.name}: {kinds}; {len(self.joints)} joints, {len(self.t)} samples>"

    @classmethod
    def from_bag(
        cls,
        path: str | Path,
        joint_states: str = JOINT_STATES,
        joints: Sequence[str] = (),
        joint_commands: str = JOINT_COMMANDS,
    ) -> "Recording":
        """A recording from a log of `wamctl excite`, or any ROS 2 bag with joint states.

        Args:
            path: an `.mcap` file, or the folder of a bag.
            joint_states: the topic of positions and efforts.
            joints: joints to take; default: all.
            joint_commands: the topic of what was commanded, if anything was.

        Raises:
            DataError: a bag that cannot be read, or without positions or torques.
        """
        bag = read_recording(path, joint_states, joint_commands, joints, torque=False)
        tau, commanded = _torque(bag, str(path))
        names = tuple(bag.joint_names)
        return cls(_seconds(bag), bag.q, tau, names, commanded=commanded, name=str(path), bag=bag)

    @property
    def log(self) -> Log:
        """The recording as a log in memory."""
        if self.bag is not None:
            return self.bag
        stamps = np.round((self.t - self.t[0]) * _NS).astype(np.int64)
        asked, tau = self.q_command, self.tau
        if self.commanded:
            command = Command(stamps, asked, None, tau)
            return Log(self.joints, stamps, self.q, None, None, command)
        command = None if asked is None else Command(stamps, asked, None, None)
        return Log(self.joints, stamps, self.q, None, tau, command)

    def named_as(self, joints: Sequence[str]) -> "Recording":
        """The recording with an arm's names of its joints, where they are the same beyond doubt.

        Args:
            joints: of the arm, such as `panda_joint1` where the recording has `fer_joint1`.
        """
        pairs = dict(renamed(self.joints, joints, ()))
        if not pairs:
            return self
        names = tuple(pairs.get(name, name) for name in self.joints)
        bag = None if self.bag is None else replace(self.bag, joint_names=names)
        return replace(self, joints=names, bag=bag)

    def _is_as_read(self, bag: Log) -> bool:
        """Whether the arrays are still those of its bag; a copy with others stands alone."""
        read = {"t": _seconds(bag), "q": bag.q, "tau": _torque(bag, self.name)[0]}
        if set(self._given()) != {k for k, x in read.items() if x is not None}:
            return False
        same = [np.array_equal(getattr(self, k), read[k], equal_nan=True) for k in self._given()]
        return all(same) and self.joints == tuple(bag.joint_names)

    def _given(self) -> list[str]:
        """The arrays that are there."""
        return [k for k in ("t", "q", "tau", "q_command") if getattr(self, k) is not None]


def _numbers(values: object, name: str) -> Array:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{name} is not an array of numbers ({error}).") from error


def _check(r: Recording) -> None:
    """Refuse arrays that cannot be a recording."""
    if isinstance(r.joints, str) or not r.joints or len(set(r.joints)) < len(r.joints):
        raise DataError(f"{r.name}: joints must be a list of different names, not {r.joints!r}.")
    if r.t.ndim != 1 or len(r.t) < 2:
        raise DataError(
            f"{r.name}: t has the shape {r.t.shape}; wanted is (samples,), in seconds, with at"
            " least two samples."
        )
    arrays = {k: getattr(r, k) for k in ("q", "tau", "q_command") if getattr(r, k) is not None}
    if len(arrays) < 2:
        raise DataError(f"{r.name}: neither tau nor q_command is given; nothing can be fitted.")
    for key, values in arrays.items():
        if values.shape != (len(r.t), len(r.joints)):
            raise DataError(
                f"{r.name}: {key} has the shape {values.shape}; wanted is"
                f" ({len(r.t)}, {len(r.joints)}): the samples of t, and the {len(r.joints)} joints."
            )
    for key, values in {"t": r.t, **arrays}.items():
        bad = ~np.isfinite(values.reshape(len(r.t), -1)).all(axis=1)
        if bad.any():
            raise DataError(
                f"{r.name}: {key} is not a finite number in sample {int(bad.argmax())}"
                f" ({int(bad.sum())} such samples); leave them out."
            )
    for key, values in arrays.items():
        most = TORQUE if key == "tau" else POSITION
        wrong = excess(values, most, r.joints, lambda s: f"in sample {s}")
        if wrong:
            raise DataError(f"{r.name}: {key} {wrong}")
    back = np.diff(r.t) < 0.0
    if back.any():
        row = int(back.argmax())
        raise DataError(
            f"{r.name}: t runs backwards, from {r.t[row]:.6f} s to {r.t[row + 1]:.6f} s at sample"
            f" {row + 1}; sort the samples by time."
        )


def _seconds(bag: Log) -> Array:
    return (bag.stamp_ns - bag.stamp_ns[0]) / _NS


def _torque(bag: Log, name: str) -> tuple[Array | None, bool]:
    """The torque at each instant, and whether it is the commanded one."""
    if bag.effort is not None:
        return bag.effort, False
    if bag.command is not None and bag.command.effort is None and bag.command.q is not None:
        return None, False
    if bag.command is None or bag.command.effort is None:
        raise DataError(f"{name}: neither measured nor commanded torque; nothing can be fitted.")
    last = np.searchsorted(bag.command.stamp_ns, bag.stamp_ns, side="right") - 1
    return bag.command.effort[np.maximum(last, 0)], True
