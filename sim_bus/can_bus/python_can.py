"""The simulated bus as a python-can interface: `can.Bus(interface="simbus", channel=PATH)`."""

import socket
import time
from collections import deque
from typing import Any

import can

from sim_bus.can_bus.frame import ERROR, EXTENDED, REMOTE, Frame, stamped, unbundle
from sim_bus.can_bus.waiting import readable, soon_readable

_PACKET_BYTES = 4096
_HUNG_S = 60.0


class SimulatedBus(can.BusABC):
    """A client of the socket that `sim-bus serve --bus simbus:PATH` listens on.

    As on a SocketCAN socket, a client does not hear its own frames. `recv` and `send` may run in
    two threads.

    Args:
        channel: path of the server's socket.
        can_filters: as for every python-can bus, filtered in this process.
        fd: allow CAN FD frames.
        lockstep: the server keeps lockstep. Then no time passes while it has not yet given all
            that follows from the frames sent, so that `recv` waits for it, whatever its limit.
        kwargs: settings of other interfaces (bit rate and the like), without a meaning here.

    Raises:
        can.CanInitializationError: nobody listens there.
    """

    def __init__(
        self,
        channel: str,
        can_filters: Any = None,
        fd: bool = False,
        lockstep: bool = False,
        **kwargs: Any,
    ) -> None:
        self.channel = str(channel)
        self.channel_info = f"simulated bus {self.channel}"
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20
        self._arrived: deque[can.Message] = deque()
        self._lockstep = lockstep
        self._sent = self._settled = self._now_ns = 0
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(self.channel)
        except OSError as error:
            self._socket.close()
            self._is_shutdown = True
            raise can.CanInitializationError(
                f"no simulated bus listens on {self.channel} ({error.strerror}): "
                f"start it with `sim-bus serve --bus simbus:{self.channel}`"
            ) from error
        super().__init__(channel=self.channel, can_filters=can_filters, **kwargs)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Give a frame to the bus; it does not wait for the wire.

        Raises:
            can.CanOperationError: the server has gone.
        """
        can_id = msg.arbitration_id
        if msg.is_extended_id:
            can_id |= EXTENDED
        if msg.is_remote_frame:
            can_id |= REMOTE
        frame = Frame(can_id, bytes(msg.data or b""), msg.is_fd)
        self._sent += 1
        try:
            self._socket.send(stamped(frame, time.monotonic_ns()))
        except OSError as error:
            raise can.CanOperationError(
                f"{self.channel_info} no longer takes frames ({error.strerror})"
            ) from error

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame; None where none comes within the time limit [s]."""
        if self.filters:
            return super().recv(timeout)
        return self._recv_internal(timeout)[0]

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        while not self._arrived:
            packet = self._packet(timeout)
            if packet is None:
                return None, False
            self._take(packet)
        return self._arrived.popleft(), False

    def _packet(self, timeout: float | None) -> bytes | None:
        while True:
            try:
                return self._socket.recv(_PACKET_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                if not self._waits(timeout):
                    return None
            except OSError as error:
                raise self._closed() from error

    def _waits(self, timeout: float | None) -> bool:
        """True once a packet can be read; false after the time limit."""
        if timeout == 0:
            return False
        if not self._lockstep or self._settled == self._sent:
            return bool(readable([self._socket], timeout))
        if soon_readable([self._socket], _HUNG_S):
            return True
        raise can.CanOperationError(
            f"{self.channel_info} has not answered for {_HUNG_S:g} s: is it in lockstep?"
        )

    def _take(self, packet: bytes) -> None:
        if not packet:
            raise self._closed()
        parts = unbundle(packet)
        self._settled += parts.settled
        self._now_ns = parts.now_ns
        ahead_ns = 0 if self._lockstep else -time.monotonic_ns() + time.time_ns()
        for frame, passed_ns in zip(parts.frames, parts.passed_ns, strict=True):
            self._arrived.append(_message(frame, self.channel, (passed_ns + ahead_ns) * 1e-9))

    def _closed(self) -> can.CanOperationError:
        return can.CanOperationError(f"{self.channel_info} was closed by its server")

    @property
    def now_s(self) -> float | None:
        """The bus's own time in lockstep [s], by which its frames are stamped; None elsewhere."""
        return self._now_ns * 1e-9 if self._lockstep else None

    def fileno(self) -> int:
        """The descriptor for `select`; once it is readable, `recv` until nothing comes."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._socket.close()

    @staticmethod
    def _detect_available_configs() -> list[Any]:
        return []


def _message(frame: Frame, channel: str, arrived_s: float) -> can.Message:
    can_id, data, fd, _ = frame
    message = can.Message(arrived_s, can_id, False, channel=channel, data=data, is_fd=fd)
    message.bitrate_switch = fd
    if can_id > 0x7FF:
        message.is_extended_id = bool(can_id & EXTENDED)
        message.is_remote_frame = bool(can_id & REMOTE)
        message.is_error_frame = bool(can_id & ERROR)
        message.arbitration_id = can_id & (0x1FFF_FFFF if can_id & EXTENDED else 0x7FF)
    return message
