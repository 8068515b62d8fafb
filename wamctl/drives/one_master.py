"""One master to a bus: a lock among programs of one machine, and an ear for all others."""

import hashlib
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import can

from wamctl.drives.bus import Channel, heard_within
from wamctl.errors import BusError

LISTENING_S = 0.25
"""Longer than any master at work keeps silent: SYNC comes every 20 ms at the latest, a master's
heartbeat every 100 ms."""

_GIVEN = "WAMCTL_BUS_LOCK"
"""Variable of the environment that tells a program which of its open files is the lock."""


@contextmanager
def locked(channel: Channel) -> Iterator[int]:
    """Keep other programs of this machine from commanding the same drives while the block runs.

    The lock is an abstract socket: it belongs to the network name space, as CAN interfaces do, and
    ends with the process, however that ends. A program that was given the lock by the one that has
    it (`handed_on`) goes through.

    Yields:
        The open file of the lock.

    Raises:
        BusError: another program has the bus.
    """
    name = f"\0wamctl-{hashlib.sha256(str(channel).encode()).hexdigest()}".encode()
    given = int(os.environ.get(_GIVEN, -1))
    if _bound_to(given) == name:
        yield given
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
        try:
            lock.bind(name)
        except OSError as error:
            raise BusError(
                f"Bus {channel} is in use by another wamctl on this machine; nothing was sent."
            ) from error
        yield lock.fileno()


def handed_on(lock: int) -> dict[str, Any]:
    """Options of `subprocess.Popen` that give a lock to a program, until both have ended.

    Args:
        lock: the open file of it.
    """
    return {"pass_fds": [lock], "env": os.environ | {_GIVEN: str(lock)}}


def _bound_to(file: int) -> bytes | None:
    """The address of an open socket; None for any other file."""
    try:
        with socket.socket(fileno=os.dup(file)) as found:
            return found.getsockname()
    except OSError:
        return None


def check_silence(bus: can.BusABC, channel: Channel, is_own: Callable[[can.Message], bool]) -> None:
    """Listen before speaking: nobody else may command these drives.

    Args:
        bus: the open bus.
        channel: what to call it.
        is_own: whether only a master of these drives sends such a frame.

    Raises:
        BusError: another master is at work, or the bus does not receive.
    """
    try:
        for frame in heard_within(bus, LISTENING_S):
            if is_own(frame):
                raise BusError(
                    f"Another program commands the drives on bus {channel}: it sent frame "
                    f"{frame.arbitration_id:#05x}. Nothing was sent."
                )
    except (can.CanError, OSError) as error:
        raise BusError(f"Bus {channel} cannot be heard ({error}).") from error
