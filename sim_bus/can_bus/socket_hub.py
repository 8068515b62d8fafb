"""A hub of its own: programs connect to a socket file, so that no kernel with CAN is needed."""

import socket
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sim_bus.can_bus.frame import Bundle, Frame, bundle, unpack, unstamp
from sim_bus.can_bus.hub import Received
from sim_bus.can_bus.waiting import Source
from sim_bus.errors import SimulatedBusError

_PACKET_BYTES = 128
_MOST_FRAMES, _MOST_SETTLED = 50, 255  # in one packet


def _remove_stale(path: Path) -> None:
    """Remove a socket that nobody serves any more, as a killed server leaves it behind.

    Raises:
        SimulatedBusError: the path is another file, or another server's.
    """
    if not path.exists():
        return
    if not path.is_socket():
        raise SimulatedBusError(
            f"sim-bus cannot make the socket {path}: a file of that name exists, and stays as it "
            "is. Name another path."
        )
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as visitor:
        try:
            visitor.connect(str(path))
        except OSError:
            path.unlink(missing_ok=True)
            return
    raise SimulatedBusError(
        f"sim-bus cannot make the socket {path}: another sim-bus serves it. Name another path."
    )


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
        _remove_stale(path)
        self._path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._clients: dict[socket.socket, _Outbox] = {}
        self.overruns = 0
        try:
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
    """Frames that wait to be sent to a client."""

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
