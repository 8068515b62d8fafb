"""Joint messages as even samples of position and torque, in the order of the arm's joints."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.recordings.errors import JointMismatchError
from ident.recordings.samples import Queue, TorqueSource
from ident.signals.arrays import Array
from ident.watch.sources import Messages
from wamctl.arm.errors import DataError
from wamctl.arm.ros2.joint_messages import joint_series
from wamctl.arm.ros2.joint_series import JointSeries

_LEARN = 100  # samples from which the period is learned
_HOLE = 10  # periods that are not bridged


@dataclass(frozen=True)
class Samples:
    """Consecutive even samples.

    Attributes:
        start_ns: stamp of the first [ns].
        period_s: between them [s].
        q, tau: position [rad] and torque [N m], each of shape (S, n).
        fresh: whether they do not follow those before them.
    """

    start_ns: int
    period_s: float
    q: Array
    tau: Array
    fresh: bool


class Sampler:
    """Makes even samples of messages.

    Args:
        joints: the arm's, n of them.
        topics: of states and commands.
        torque: which to use; None: the commanded one where it comes among the first states.
        source: what to call it.
        delay_s: by which torque acts later than its stamps say [s].
    """

    def __init__(
        self,
        joints: Sequence[str],
        topics: tuple[str, str],
        torque: TorqueSource | None,
        source: str,
        delay_s: float = 0.0,
    ) -> None:
        n = len(joints)
        self._joints, self._topics, self._torque = tuple(joints), topics, torque
        self._source, self._later_ns = source, round(delay_s * 1e9)
        self._q, self._tau = Queue(n, np.int64), Queue(n, np.int64)
        self._period_ns = 0.0
        self._next_ns: float | None = None

    def samples(self, batches: Iterable[Messages]) -> Iterator[Samples]:
        """The samples as they get complete.

        Raises:
            DataError: joints or torque that cannot be used.
        """
        for batch in batches:
            self._take(batch)
            if not self._period_ns and len(self._q.t) >= _LEARN:
                self._period_ns = float(np.median(np.diff(self._q.t)))
            while self._period_ns:
                found = self._ready()
                if found is None:
                    break
                yield found
        if not self._period_ns:
            raise DataError(
                f"{self._source} ended after {len(self._q.t)} samples of these joints; there is"
                " nothing to watch."
            )

    def _take(self, batch: Messages) -> None:
        states, commands = self._topics
        measured, wanted = self._series(batch, states), self._series(batch, commands)
        for series in measured:
            self._add(self._q, series, series.stamp_ns, series.positions)
        if self._torque is None and any(s.effort is not None for s in wanted):
            self._torque = "commanded"
        elif self._torque is None:  # a live server sends one message at a time
            if len(self._q.t) < _LEARN and not any(s.effort is not None for s in measured):
                return
            self._torque = "measured"
        for series in wanted if self._torque == "commanded" else measured:
            if series.effort is not None:
                self._add(self._tau, series, series.stamp_ns + self._later_ns, series.effort)
        if measured and self._torque == "measured" and not len(self._tau.t):
            raise DataError(f"{self._source} holds no joint torque; nothing can be watched.")

    def _series(self, batch: Messages, topic: str) -> list[JointSeries]:
        if topic not in batch:
            return []
        stamps, data = batch[topic]
        return joint_series(data, stamps)

    def _add(
        self, waiting: Queue, series: JointSeries, ns: NDArray[np.int64], values: Array
    ) -> None:
        missing = [j for j in self._joints if j not in series.joint_names]
        if missing:
            raise JointMismatchError(self._source, missing, series.joint_names)
        last = waiting.t[-1] if len(waiting.t) else -1
        new = np.diff(ns, prepend=last) > 0
        columns = [series.joint_names.index(j) for j in self._joints]
        waiting.add(ns[new], values[new][:, columns])

    def _ready(self) -> Samples | None:
        """The samples up to where both topics are known, or to a hole."""
        q, tau, period = self._q, self._tau, self._period_ns
        if len(q.t) < 2 or len(tau.t) < 2:
            return None
        fresh = self._next_ns is None
        first = float(max(q.t[0], tau.t[0])) if self._next_ns is None else self._next_ns
        holes = np.flatnonzero(np.diff(q.t) > _HOLE * period)
        end = float(min(q.t[holes[0]] if len(holes) else q.t[-1], tau.t[-1]))
        count = int((end - first) / period + 1e-6) + 1
        found = None
        if end >= first:
            grid = first + period * np.arange(count)
            now = np.column_stack([np.interp(grid, q.t, c) for c in q.values.T])
            found = Samples(round(first), period * 1e-9, now, self._torque_at(grid), fresh)
            self._next_ns = first + period * count
        if len(holes) and (found is None or end >= q.t[holes[0]] - period):
            self._next_ns = None
            q.drop(int(holes[0]) + 1)
            tau.drop(max(int(np.searchsorted(tau.t, q.t[0])) - 2, 0))
        elif found is not None:
            for waiting in (q, tau):
                waiting.drop(max(int(np.searchsorted(waiting.t, self._next_ns or 0.0)) - 2, 0))
        return found

    def _torque_at(self, grid: Array) -> Array:
        """A measured torque between its samples; a commanded one is held until the next comes."""
        tau = self._tau
        if self._torque == "measured":
            return np.column_stack([np.interp(grid, tau.t, c) for c in tau.values.T])
        here = np.clip(np.searchsorted(tau.t, grid + 1.0, side="right") - 1, 0, len(tau.t) - 1)
        return 0.5 * (tau.values[here] + tau.values[np.maximum(here - 1, 0)])
