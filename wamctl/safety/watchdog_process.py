"""The process that takes torque away when the loop no longer can: it holds nothing else.

Started as `python -m wamctl.safety.watchdog_process HEART BUS` with two descriptors: the loop's
heart in shared memory and the socket of the bus, which both share. One line of JSON on its input
says for how long the heart may stand still and which frames take torque away; it answers `ready`.
It sends nothing unless the heart is watched and stands still, or the loop has died with it. It
imports nothing that could fail or delay it.
"""

import json
import mmap
import os
import select
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

WATCHED, BEATS, FIRED = range(3)
"""Places in the heart: whether it is to be watched, how often it has beaten, and whether torque was
taken away."""
HEART_BYTES = 8 * (FIRED + 1)
READY, DONE = "ready", "done"
LOOKS = 4
"""So many looks in a row must find the heart still: a machine that stood still as a whole wakes
this process as well as the loop, and gives the loop time for a beat."""
_PRIORITY = 10  # where the system grants it: below the loop's
_TIMES, _PAUSE_S = 5, 0.01


def main() -> None:
    """Watch one heart."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # its end is the loop's, or `done`
    heart = memoryview(mmap.mmap(int(sys.argv[1]), HEART_BYTES)).cast("q")
    bus = int(sys.argv[2])
    about = json.loads(sys.stdin.buffer.readline())
    frames = [bytes.fromhex(frame) for frame in about["frames"]]
    with suppress(OSError):  # without the right to it
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    os.write(sys.stdout.fileno(), f"{READY}\n".encode())
    watch(heart, bus, frames, about["silence_s"])


def watch(heart: memoryview, bus: int, frames: Sequence[bytes], silence_s: float) -> None:
    """Look at a heart until the loop says that all is over, or takes torque away for it."""
    seen, still = -1, 0
    while True:
        heard = select.select([sys.stdin], [], [], silence_s / LOOKS)[0]
        if heard and os.read(sys.stdin.fileno(), 64).strip() == DONE.encode():
            return
        still = still + 1 if heart[WATCHED] and heart[BEATS] == seen else 0
        seen = heart[BEATS]
        if (heard and heart[WATCHED]) or still > LOOKS:
            heart[FIRED] = 1
            _take_torque_away(bus, frames)
            return
        if heard:
            return  # the loop has died without torque


def _take_torque_away(bus: int, frames: Sequence[bytes]) -> None:
    for _ in range(_TIMES):
        for frame in frames:
            with suppress(OSError):  # a full or broken bus: the others may get through
                os.write(bus, frame)
        time.sleep(_PAUSE_S)


if __name__ == "__main__":
    main()
