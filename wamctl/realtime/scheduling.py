"""What the operating system can do for punctuality, and what to type where it does not."""

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

PRIORITY = 45  # above the simulated arm's, below the kernel's own threads
_LOCK_CURRENT, _LOCK_FUTURE = 1, 2
_WAKE_UP_LIMIT = Path("/dev/cpu_dma_latency")  # the kernel's PM QoS: an int32 [us]


@dataclass(frozen=True)
class Privileges:
    """What the system granted.

    Attributes:
        scheduling: in words.
        memory_locked: whether pages stay in memory.
        advice: what the operator can type for what is missing.
    """

    scheduling: str
    memory_locked: bool
    advice: tuple[str, ...]


@contextmanager
def real_time_scheduling(real_time: bool) -> Iterator[Privileges]:
    """Real-time scheduling, locked memory, cores awake and no garbage collection in a block.

    Children are started with ordinary scheduling.

    Args:
        real_time: ask the system for it; otherwise only the garbage collection is held.
    """
    privileges = _ask() if real_time else Privileges("ordinary", False, ())
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        with _awake() if real_time else nullcontext():
            yield privileges
    finally:
        gc.enable()
        gc.unfreeze()
        if privileges.scheduling != "ordinary":
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        if privileges.memory_locked:
            ctypes.CDLL(None).munlockall()


@contextmanager
def _awake() -> Iterator[None]:
    """No core falls so deeply asleep that it wakes late, as cyclictest asks for as well."""
    try:
        limit = _WAKE_UP_LIMIT.open("wb", buffering=0)
    except OSError:
        yield
        return
    with limit:  # the kernel forgets it when the file is closed
        limit.write(bytes(4))
        yield


def _ask() -> Privileges:
    advice, scheduling = [], f"SCHED_FIFO {PRIORITY}"
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
    except PermissionError:
        scheduling = "ordinary"
        advice.append(f"real-time priority: sudo prlimit --pid $$ --rtprio={PRIORITY}:{PRIORITY}")
    locked = ctypes.CDLL(None).mlockall(_LOCK_CURRENT | _LOCK_FUTURE) == 0
    if not locked:
        advice.append("locked memory: sudo prlimit --pid $$ --memlock=unlimited:unlimited")
    if _WAKE_UP_LIMIT.exists() and not os.access(_WAKE_UP_LIMIT, os.W_OK):
        advice.append(f"cores that stay awake: sudo chmod o+w {_WAKE_UP_LIMIT}")
    return Privileges(scheduling, locked, tuple(advice))
