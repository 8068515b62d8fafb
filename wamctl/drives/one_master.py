"""One master to a bus: a lock among programs of one machine, and an ear for all others."""

import hashlib
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can

from wamctl.drives.bus import Channel
from wamctl.errors import BusError

LISTENING_S = 0.25
"""Longer than any master at work keeps silent: SYNC comes every 20 ms at the latest, a master's
heartbeat every 100 ms."""


@contextmanager
def locked(channel: Channel) -> Iterator[None]:
    """Keep other programs of this machine from commanding the same drives while the block runs.

    The lock is an abstract socket: it belongs to the network name space, as CAN interfaces do, and
    ends with the process, however that ends.

    Raises:
        BusError: another program has the bus.
    """
    name = hashlib.sha256(str(channel).encode()).hexdigest()
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
        try:
            lock.bind(f"\0wamctl-{name}")
        except OSError as error:
            raise BusError(
                f"Bus {channel} is in use by another wamctl on this machine; nothing was sent."
            ) from error
        yield


def check_silence(bus: can.BusABC, channel: Channel, is_own: Callable[[can.Message], bool]) -> None:
    """Listen before speaking: nobody else may command these drives.

    Args:
        bus: the open bus.
        channel: what to call it.
        is_own: whether only a master of these drives sends such a frame.

    Raises:
        BusError: another master is at work, or the bus does not receive.
    """
    end_s = time.monotonic() + LISTENING_S
    try:
        while (left_s := end_s - time.monotonic()) > 0:
            frame = bus.recv(left_s)
            if frame is not None and is_own(frame):
                raise BusError(
                    f"Another program commands the drives on bus {channel}: it sent frame "
                    f"{frame.arbitration_id:#05x}. Nothing was sent."
                )
    except (can.CanError, OSError) as error:
        raise BusError(f"Bus {channel} cannot be heard ({error}).") from error
