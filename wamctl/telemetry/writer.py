"""The process that writes the log, so that no disk ever delays the loop.

Started as `python -m wamctl.telemetry.writer DESCRIPTOR`. One line of JSON on its input says what
the log is about; it answers `ready` and empties the ring until its input ends: with a last line
when the experiment is over, or without one when the loop has died. Then it answers `closed`; a line
other than these says why the log is not whole.
"""

import base64
import json
import os
import select
import signal
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from wamctl.arm.errors import DataError
from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.ros2.log_messages import Status
from wamctl.telemetry import ring as shared
from wamctl.telemetry.status import diagnostics

DONE, READY, CLOSED = "done", "ready", "closed"
"""The loop's last word after a whole experiment, and the writer's answers."""
_POLL_S = 0.02
_ERROR = 2


def main() -> None:
    """Write one log."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the operator's stop is for the loop
    about = json.loads(sys.stdin.buffer.readline())
    ring = shared.attach(int(sys.argv[1]), len(about["joint_names"]))
    attachments = {name: base64.b64decode(data) for name, data in about["attachments"].items()}
    state_names = {int(code): name for code, name in about["state_names"].items()}
    path = Path(about["path"])
    try:
        _reserve(path)
        with Recorder(path, about["joint_names"], about["metadata"], attachments) as recorder:
            file = path.stat()
            _answer(READY)
            _serve(recorder, ring, about["drives"], state_names)
        _check_still_there(path, file)
        _answer(CLOSED)
    except DataError as error:
        _answer(str(error))
        ring.header[shared.WRITER_FAILED] = 1
        sys.exit(error.exit_code)


def _reserve(path: Path) -> None:
    """Make the file, so that no two runs write the same one.

    Raises:
        DataError: it exists already, or cannot be made.
    """
    try:
        path.open("xb").close()
    except FileExistsError as error:
        raise DataError(f"The log {path} exists already: name another with --out.") from error
    except OSError as error:
        raise DataError(f"The log {path} cannot be written ({error.strerror}).") from error


def _check_still_there(path: Path, file: os.stat_result) -> None:
    """See whether the path still leads to the file that was written.

    Raises:
        DataError: somebody has deleted or replaced it meanwhile.
    """
    try:
        if os.path.samestat(path.stat(), file):
            return
    except OSError as error:
        raise DataError(f"The log {path} is gone: deleted while it was written.") from error
    raise DataError(f"The log {path} is another file: it was replaced while it was written.")


def _serve(
    recorder: Recorder, ring: shared.Ring, drives: Sequence[str], state_names: Mapping[int, str]
) -> None:
    ended = False
    while not ended:
        ended = bool(select.select([sys.stdin], [], [], _POLL_S)[0])
        _empty(recorder, ring, drives, state_names)
    last = os.read(sys.stdin.fileno(), 1 << 16).decode(errors="replace").strip()
    _empty(recorder, ring, drives, state_names)
    if ring.header[shared.PRODUCED]:
        newest = int(ring.header[shared.PRODUCED] - 1) % shared.SLOTS
        level = 0 if last == DONE else _ERROR
        message = last or "the loop ended without a word"
        recorder.diagnostics(int(ring.stamps_ns[newest]), [Status("experiment", level, message)])


def _empty(
    recorder: Recorder, ring: shared.Ring, drives: Sequence[str], state_names: Mapping[int, str]
) -> None:
    n, header = len(drives), ring.header
    while header[shared.CONSUMED] < header[shared.PRODUCED]:
        slot = int(header[shared.CONSUMED]) % shared.SLOTS
        stamp_ns, row = int(ring.stamps_ns[slot]), ring.values[slot].copy()
        if ring.kinds[slot] == shared.CYCLE:
            q, qd, q_ref, qd_ref, qdd_ref, tau = row[: shared.COLUMNS * n].reshape(-1, n)
            recorder.cycle(CycleRecord(stamp_ns, q, qd, None, q_ref, qd_ref, qdd_ref, tau))
            header[shared.ROWS_WRITTEN] += 1
        else:
            recorder.diagnostics(stamp_ns, diagnostics(row, drives, state_names))
        header[shared.CONSUMED] += 1


def _answer(text: str) -> None:
    with suppress(BrokenPipeError):  # the loop may have died
        os.write(sys.stdout.fileno(), f"{text}\n".encode())


if __name__ == "__main__":
    main()
