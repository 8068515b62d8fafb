"""Any bus of python-can as a hub."""

import time
from collections.abc import Sequence
from typing import Any

import can

from sim_bus.can_bus.frame import ERROR, EXTENDED, REMOTE, Frame
from sim_bus.can_bus.hub import Received
from sim_bus.can_bus.waiting import Source
from sim_bus.errors import SimulatedBusError


class PythonCanHub:
    """A bus of python-can, which carries the other programs' frames by itself.

    Raises:
        SimulatedBusError: the bus cannot be opened.
    """

    gathers = False

    def __init__(self, interface: str, channel: str, fd: bool = False) -> None:
        settings: dict[str, Any] = {"fd": True} if fd else {}
        if interface == "udp_multicast":
            settings["hop_limit"] = 0  # stays on this machine
        self._own: list[tuple[int, bytes]] = []
        self._hears_itself = interface == "udp_multicast"
        try:
            self._bus = can.Bus(interface=interface, channel=channel, **settings)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise SimulatedBusError(
                f"sim-bus cannot open the bus {interface}:{channel} ({error}): "
                "`--bus simbus:PATH` needs no CAN interface."
            ) from error

    def sources(self) -> Sequence[Source]:
        """The bus."""
        return [self._bus]

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        """Frames of others."""
        frames: list[Received] = []
        while readable and (message := self._bus.recv(0)) is not None:
            frame = _frame(message)
            seen = (frame.can_id, frame.data)
            if self._hears_itself and seen in self._own:
                self._own.remove(seen)
            else:
                frames.append(Received(frame, self, _monotonic_ns(message)))
        return frames

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Send drives' frames; the frames of other programs are on the bus already."""
        if sender is not self:
            for frame in frames:
                self._deliver(frame)

    def settle(self, sender: object, time_ns: int) -> None:
        """Nothing: a CAN bus has no word for it."""

    def flush(self) -> None:
        """Nothing: frames are sent when they are delivered."""

    def _deliver(self, frame: Frame) -> None:
        if self._hears_itself:
            self._own.append((frame.can_id, frame.data))
        self._bus.send(
            can.Message(
                arbitration_id=frame.can_id,
                data=frame.data,
                is_extended_id=False,
                is_fd=frame.fd,
                bitrate_switch=frame.fd,
            )
        )

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def _frame(message: can.Message) -> Frame:
    can_id = message.arbitration_id
    can_id |= EXTENDED if message.is_extended_id else 0
    can_id |= REMOTE if message.is_remote_frame else 0
    can_id |= ERROR if message.is_error_frame else 0
    return Frame(can_id, bytes(message.data), message.is_fd)


def _monotonic_ns(message: can.Message) -> int:
    """When the kernel took a message, on the monotonic clock [ns]."""
    return round(message.timestamp * 1e9) + time.monotonic_ns() - time.time_ns()
