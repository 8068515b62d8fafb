"""The loop's end of the log: a row into shared memory each cycle, and a watch on the writer."""

import base64
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from wamctl.arm.arrays import Array
from wamctl.arm.control import Setpoint
from wamctl.arm.errors import DataError, UserError
from wamctl.errors import OutsideStopError
from wamctl.telemetry import ring as shared
from wamctl.telemetry.child_process import ChildProcess
from wamctl.telemetry.display import display
from wamctl.telemetry.ring import Ring
from wamctl.telemetry.status import LoopStatus, Phase, store
from wamctl.telemetry.writer import CLOSED, DONE, READY

_START_S = 60.0
_CLOSE_S = 20.0
_TELL_S = 1.0
_PATIENCE_S = 10.0


@dataclass(frozen=True)
class LogHead:
    """What the log is about.

    Attributes:
        path: the file.
        joint_names: names of the n joints.
        drives: name of each drive.
        state_names: the drives' states in words, by number.
        metadata: facts about the run.
        attachments: files that travel inside the log.
    """

    path: Path
    joint_names: Sequence[str]
    drives: Sequence[str]
    state_names: Mapping[int, str]
    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes]


LiveView = Callable[[int, LogHead], AbstractContextManager[None]]
"""A viewer that runs while the block runs, given the ring's descriptor."""


class Logger:
    """An open log.

    Attributes:
        rows: cycles that were given to the writer.
        cut: why the closed log is not whole, as a sentence; None if it is.

    Args:
        path: the file.
        joints: number of joints.
        child: the process that writes it.
        ring: where the rows go.
        waits: wait for a slow writer instead of stopping; for clocks that stand still meanwhile.
    """

    def __init__(
        self, path: Path, joints: int, child: ChildProcess, ring: Ring, waits: bool
    ) -> None:
        self._path, self._joints, self._child = path, joints, child
        self._ring, self._waits = ring, waits
        self._broken = False
        self.rows = 0
        self.cut: str | None = None

    @property
    def rows_on_disk(self) -> int:
        """Cycles that the writer has given to the file; all of them are there once it has ended."""
        return int(self._ring.header[shared.ROWS_WRITTEN])

    @property
    def process_id(self) -> int:
        """The writer's."""
        return self._child.process_id

    @property
    def summary(self) -> str:
        """What the closed log holds, as a part of a sentence."""
        if self.cut is None:
            return f"the log {self._path} holds {self.rows_on_disk} cycles"
        cut = self.cut[:1].lower() + self.cut[1:].rstrip(".")
        return f"{cut}; at most {self.rows_on_disk} of {self.rows} cycles are in it"

    def cycle(self, stamp_ns: int, q: Array, qd: Array, wanted: Setpoint, tau: Array) -> None:
        """One row.

        Args:
            stamp_ns: sampling instant [ns].
            q: measured position [rad], shape (n,).
            qd: estimated velocity [rad/s], shape (n,).
            wanted: the reference.
            tau: commanded torque that acts from the stamp on [N m], shape (n,).

        Raises:
            OutsideStopError: the writer is too far behind; later rows are dropped without a word.
        """
        if self._broken:
            return
        slot, n = self._slot(), self._joints
        row = self._ring.values[slot]
        for k, column in enumerate((q, qd, wanted.q, wanted.qd, wanted.qdd, tau)):
            row[k * n : (k + 1) * n] = column
        self._publish(slot, shared.CYCLE, stamp_ns)
        self.rows += 1

    def progress(self, phase: Phase, done: int, total: int) -> None:
        """What the loop is at, for whoever shows it."""
        header = self._ring.header
        header[shared.PHASE], header[shared.DONE], header[shared.TOTAL] = phase, done, total

    def status(self, stamp_ns: int, status: LoopStatus, states: Sequence[int]) -> None:
        """One record for the diagnostics; looks after the writer as well.

        Raises:
            OutsideStopError: the writer has died, cannot write, or is too far behind.
        """
        if self._broken:
            return
        self._check()
        slot = self._slot()
        store(self._ring.values[slot], status, states)
        self._publish(slot, shared.STATUS, stamp_ns)

    def close(self, last_word: str) -> None:
        """End the log with the reason, and wait for the writer."""
        self.cut = self._closed(last_word)

    def _closed(self, last_word: str) -> str | None:
        self._child.tell(last_word, _TELL_S)
        answer = self._child.answer(_CLOSE_S)
        status = self._child.end(_CLOSE_S if answer else _TELL_S)
        if status == 0 and answer == CLOSED:
            return None
        if answer and answer != CLOSED:
            return answer
        how = "was killed, since it hung" if status is None else f"ended with status {status}"
        return f"The log {self._path} is cut: its writer {how}."

    def _slot(self) -> int:
        slot = self._ring.free_slot()
        if slot < 0 and self._waits:
            slot = self._wait_for_slot()
        if slot < 0:
            raise self._break(f"is {shared.SLOTS} records behind")
        return slot

    def _wait_for_slot(self) -> int:
        deadline = time.monotonic() + _PATIENCE_S
        while (slot := self._ring.free_slot()) < 0 and time.monotonic() < deadline:
            self._check()
            time.sleep(0.001)
        return slot

    def _publish(self, slot: int, kind: int, stamp_ns: int) -> None:
        self._ring.kinds[slot] = kind
        self._ring.stamps_ns[slot] = stamp_ns
        self._ring.header[shared.PRODUCED] += 1

    def _check(self) -> None:
        if self._ring.header[shared.WRITER_FAILED]:
            reason = self._child.answer(_TELL_S).rstrip(".")
            raise self._break(f"cannot write any more ({reason})")
        status = self._child.status
        if status is not None:
            raise self._break(f"ended with status {status}")

    def _break(self, what: str) -> OutsideStopError:
        self._broken = True
        return OutsideStopError(f"the process that writes the log {self._path} {what}")


def _json(head: LogHead) -> str:
    about = vars(head) | {
        "path": str(head.path),
        "metadata": dict(head.metadata),
        "state_names": dict(head.state_names),
        "attachments": {k: base64.b64encode(v).decode() for k, v in head.attachments.items()},
    }
    return json.dumps(about)


@contextmanager
def recorded(
    head: LogHead, waits: bool, shown: bool, live_views: Sequence[LiveView] = ()
) -> Iterator[Logger]:
    """An open log that ends with the reason for which the block is left.

    Args:
        head: what the log is about.
        waits: wait for a slow writer instead of stopping.
        shown: show progress where standard error is a terminal.
        live_views: viewers that run while the log is open.

    Raises:
        DataError: the file cannot be written, or is not whole.
        UserError: a viewer cannot start; no log is written then.
    """
    joints = len(head.joint_names)
    last_word = "the experiment ended with a bug"
    with shared.created(joints) as (descriptor, ring), ExitStack() as watching:
        for live_view in live_views:
            watching.enter_context(live_view(descriptor, head))
        log = _opened(head, descriptor, ring, waits)
        try:
            with display(descriptor, joints) if shown else nullcontext():
                yield log
            last_word = DONE
        except UserError as error:
            last_word = str(error)
            raise
        finally:
            log.close(last_word)
    if log.cut is not None:
        raise DataError(log.cut)


def _opened(head: LogHead, descriptor: int, ring: Ring, waits: bool) -> Logger:
    child = ChildProcess("wamctl.telemetry.writer", [str(descriptor)], [descriptor])
    child.tell(_json(head), _START_S)
    answer = child.answer(_START_S)
    if answer != READY:
        status = child.end(_TELL_S)
        raise DataError(
            answer or f"The log {head.path} cannot be written: its writer ended ({status})."
        )
    return Logger(head.path, len(head.joint_names), child, ring, waits)
