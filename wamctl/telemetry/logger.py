"""The loop's end of the log: a row into shared memory each cycle, and a watch on the writer."""

import base64
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wamctl.arm.control import Setpoint
from wamctl.arm.errors import DataError, UserError
from wamctl.errors import SafetyStopError
from wamctl.telemetry import ring as shared
from wamctl.telemetry.display import display
from wamctl.telemetry.phase import Phase
from wamctl.telemetry.ring import Ring
from wamctl.telemetry.status import LoopStatus, store
from wamctl.telemetry.writer import DONE

Array = NDArray[np.floating]

_CLOSE_S = 60.0
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

    Args:
        head: what the log is about.
        descriptor: the ring's.
        ring: where the rows go.
        waits: wait for a slow writer instead of stopping; for clocks that stand still meanwhile.

    Raises:
        DataError: the file cannot be written.
    """

    def __init__(self, head: LogHead, descriptor: int, ring: Ring, waits: bool) -> None:
        self._path, self._ring, self._waits = head.path, ring, waits
        self._joints = len(head.joint_names)
        self._closed = self._broken = False
        self.rows = 0
        self._process = subprocess.Popen(
            [sys.executable, "-m", "wamctl.telemetry.writer", str(descriptor)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=(descriptor,),
            start_new_session=True,  # a Ctrl-C at the terminal must not reach it
        )
        self._tell(_json(head))
        answer = self._answer()
        if answer != "ready":
            cut = self.close("")
            raise DataError(answer or cut)

    @property
    def process_id(self) -> int:
        """The writer's."""
        return self._process.pid

    def cycle(self, stamp_ns: int, q: Array, qd: Array, wanted: Setpoint, tau: Array) -> None:
        """One row.

        Args:
            stamp_ns: sampling instant [ns].
            q: measured position [rad], shape (n,).
            qd: estimated velocity [rad/s], shape (n,).
            wanted: the reference.
            tau: commanded torque that acts from the stamp on [N m], shape (n,).

        Raises:
            SafetyStopError: the writer is too far behind; later rows are dropped without a word.
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
            SafetyStopError: the writer has died, cannot write, or is too far behind.
        """
        if self._broken:
            return
        self._check()
        slot = self._slot()
        store(self._ring.values[slot], status, states)
        self._publish(slot, shared.STATUS, stamp_ns)

    def close(self, last_word: str) -> str | None:
        """End the log with the reason and wait for the writer; returns why it is not whole."""
        if self._closed:
            return None
        self._closed = True
        self._tell(last_word.replace("\n", " "))
        answer = self._answer()
        status = self._process.wait(_CLOSE_S)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(BrokenPipeError):
                    pipe.close()
        if status == 0:
            return None
        return answer or f"The log {self._path} is cut: its writer ended with status {status}."

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
            raise self._break("cannot write any more")
        status = self._process.poll()
        if status is not None:
            raise self._break(f"ended with status {status}")

    def _break(self, what: str) -> SafetyStopError:
        self._broken = True
        return SafetyStopError(f"the process that writes the log {self._path} {what}")

    def _tell(self, line: str) -> None:
        if self._process.stdin is None:
            return
        try:
            self._process.stdin.write(line.encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            return  # it has died; its exit status tells

    def _answer(self) -> str:
        if self._process.stdout is None:
            return ""
        return self._process.stdout.readline().decode().strip()


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
        log = Logger(head, descriptor, ring, waits)
        try:
            with display(descriptor, joints) if shown else nullcontext():
                yield log
            last_word = DONE
        except UserError as error:
            last_word = str(error)
            raise
        finally:
            cut = log.close(last_word)
    if cut is not None:
        raise DataError(cut)
