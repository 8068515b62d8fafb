"""Where the frames of the simulated drives meet the programs on the bus."""

import socket
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import can

from sim_bus.errors import SimulatedBusError
from sim_bus.frame import ERROR, EXTENDED, REMOTE, Bundle, Frame, bundle, unpack, unstamp
from sim_bus.look_out import Source

_PACKET_BYTES = 128
_MOST_FRAMES, _MOST_SETTLED = 50, 255  # in one packet


class Received(NamedTuple):
    """A frame that a program has sent.

    Attributes:
        frame: the frame.
        sender: the program's connection.
        sent_ns: when it was sent [ns, monotonic clock], so that a simulation that was held up does
            not take the frame for a later one; None where nobody knows.
    """

    frame: Frame
    sender: object
    sent_ns: int | None


class Hub(Protocol):
    """Programs on one side of the wire.

    Attributes:
        gathers: whether a call of the system costs so much more than a frame that frames which
            follow each other without a pause should be given out together.
    """

    gathers: bool

    def sources(self) -> Sequence[Source]:
        """What to `select` for reading."""
        ...

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        """All frames that have come in, after `select` has found these sources readable."""
        ...

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Give frames to all programs but their sender, by the next `flush`.

        Args:
            frames: the frames.
            sender: who does not get them.
            time_ns: when they passed, where they do not say otherwise [ns].
        """
        ...

    def settle(self, sender: object, time_ns: int) -> None:
        """A program has been given all that follows from its oldest open frame; see `flush`.

        Args:
            sender: the program.
            time_ns: the bus's time by then [ns].
        """
        ...

    def flush(self) -> None:
        """Let the programs have all that is for them."""
        ...

    def close(self) -> None:
        """Leave."""
        ...


class SocketHub:
    """Programs that connect to a socket file.

    A program sends one frame a packet. It gets frames that reach it together in one packet, since
    each packet may wake it up, which costs more than the frame; the packet also tells how many of
    the program's own frames are settled: all that follows from them is out.

    Attributes:
        overruns: frames that a program was too slow to take.

    Raises:
        SimulatedBusError: the socket cannot be made.
    """

    gathers = False

    def __init__(self, path: Path) -> None:
        self._path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._clients: dict[socket.socket, _Outbox] = {}
        self.overruns = 0
        try:
            path.unlink(missing_ok=True)
            self._listener.bind(str(path))
            self._listener.listen()
        except OSError as error:
            self._listener.close()
            raise SimulatedBusError(
                f"sim-bus cannot make the socket {path} ({error.strerror}): name a path in a "
                "folder that exists and is writable, with less than 108 characters."
            ) from error

    def sources(self) -> Sequence[Source]:
        """The listening socket and all clients."""
        return [self._listener, *self._clients]

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        """Frames from the clients; also lets new clients in."""
        frames: list[Received] = []
        if self._listener in readable:
            client, _ = self._listener.accept()
            self._clients[client] = _Outbox()
        for client in list(self._clients):
            frames += self._drain(client)
        return frames

    def _drain(self, client: socket.socket) -> Iterable[Received]:
        while True:
            try:
                packet = client.recv(_PACKET_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            if not packet:
                self._drop(client)
                return
            packed, sent_ns = unstamp(packet)
            frame = unpack(packed)
            if frame is not None:
                yield Received(frame, client, sent_ns)

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Give frames to all clients but their sender, by the next `flush`."""
        passed_ns = [frame.passed_ns or time_ns for frame in frames]
        for client, outbox in self._clients.items():
            if client is not sender:
                outbox.frames += frames
                outbox.passed_ns += passed_ns
                outbox.now_ns = time_ns

    def settle(self, sender: object, time_ns: int) -> None:
        """A client has been given all that follows from its oldest open frame; see `flush`."""
        for client, outbox in self._clients.items():
            if client is sender:
                outbox.settled += 1
                outbox.now_ns = time_ns

    def flush(self) -> None:
        """Send each client what is for it; a client that is too slow loses frames."""
        for client, outbox in list(self._clients.items()):
            while outbox.frames or outbox.settled:
                self._send(client, outbox)

    def _send(self, client: socket.socket, outbox: "_Outbox") -> None:
        """One packet."""
        parts = outbox.take()
        try:
            client.send(bundle(parts), socket.MSG_DONTWAIT)
        except BlockingIOError:
            self.overruns += len(parts.frames)
        except OSError:
            self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        self._clients.pop(client, None)
        client.close()

    def close(self) -> None:
        """Let all clients go and remove the socket file."""
        for client in list(self._clients):
            self._drop(client)
        self._listener.close()
        self._path.unlink(missing_ok=True)


@dataclass
class _Outbox:
    """What a client is to be sent."""

    frames: list[Frame] = field(default_factory=list)
    passed_ns: list[int] = field(default_factory=list)
    settled: int = 0
    now_ns: int = 0

    def take(self) -> Bundle:
        """As much of it as a packet holds."""
        settled = min(self.settled, _MOST_SETTLED)
        parts = Bundle(
            settled, self.now_ns, self.frames[:_MOST_FRAMES], self.passed_ns[:_MOST_FRAMES]
        )
        del self.frames[:_MOST_FRAMES], self.passed_ns[:_MOST_FRAMES]
        self.settled -= settled
        return parts


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
