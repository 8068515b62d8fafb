"""Opening a CAN bus from its word, `INTERFACE:CHANNEL`."""

import errno
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import can

from wamctl.arm.config import BusSection
from wamctl.drives.interface import CycleTiming
from wamctl.drives.socketcan import BurstBus
from wamctl.errors import BusError, UsageError

EMBEDDED = "sim"
_SIMULATED_ONLY = frozenset({"simbus", "virtual", "udp_multicast"})
_WALL_CLOCK = frozenset({"simbus", "socketcan"})
_NO_ECHO = frozenset({"simbus", "socketcan", "virtual"})
_SHARED_SOCKET = frozenset({"simbus", "socketcan"})
_REASONS: dict[int | None, str] = {
    errno.EAFNOSUPPORT: "this kernel has no CAN: `modprobe can_raw` loads it, where it is built",
    errno.ENODEV: "there is no such network interface: `ip link` lists them",
}
_HINT = "`--bus sim` runs the simulated arm and needs no hardware"


@dataclass(frozen=True)
class Channel:
    """A bus by python-can's words."""

    interface: str
    name: str

    def __str__(self) -> str:
        return f"{self.interface}:{self.name}"

    @property
    def may_lockstep(self) -> bool:
        """Whether only simulated drives can be there, which do not mind a bus without a clock."""
        return self.interface in _SIMULATED_ONLY or self.name.startswith(("vcan", "vxcan"))

    @property
    def stamps_by_wall_clock(self) -> bool:
        """Whether frames are stamped as they pass, by the clock of `time.time`."""
        return self.interface in _WALL_CLOCK

    @property
    def may_echo(self) -> bool:
        """Whether our own frames may come back to us, so that they tell nothing about others."""
        return self.interface not in _NO_ECHO

    @property
    def has_shared_socket(self) -> bool:
        """Whether its socket takes frames in the kernel's layout, from two processes."""
        return self.interface in _SHARED_SOCKET

    @property
    def is_embedded(self) -> bool:
        """Whether it is the simulated bus that this project brings along."""
        return self.interface == "simbus"


@runtime_checkable
class SimulatedTime(Protocol):
    """A bus with a time of its own: the simulated one in lockstep."""

    @property
    def now_s(self) -> float | None:
        """Its present time, by which its frames are stamped [s]; None where it has none."""
        ...


def parse_channel(word: str) -> Channel:
    """The bus that a word names; a socket of the simulated bus has one name, its whole path.

    Raises:
        UsageError: not of the form INTERFACE:CHANNEL, or no such interface.
    """
    interface, colon, name = word.partition(":")
    if not (interface and colon and name):
        raise UsageError(
            f"bus {word!r} is neither `sim` nor INTERFACE:CHANNEL, such as socketcan:can0; {_HINT}."
        )
    if interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise UsageError(
            f"bus {word!r}: python-can has no interface {interface!r} (it has {known})."
        )
    channel = Channel(interface, name)
    return Channel(interface, str(Path(name).resolve())) if channel.is_embedded else channel


def open_bus(channel: Channel, section: BusSection, lockstep: bool = False) -> can.BusABC:
    """The open bus.

    Args:
        channel: which.
        section: its bit rates and kind of frames.
        lockstep: on the simulated bus, no time passes while the arm has not answered.

    Raises:
        BusError: it is not there or refuses.
    """
    settings: dict[str, Any] = {"bitrate": round(section.bitrate_bit_s)}
    if section.is_fd:
        settings |= {"fd": True, "data_bitrate": section.data_bitrate_bit_s}
    if channel.is_embedded:
        settings["lockstep"] = lockstep
    if channel.interface == "udp_multicast":
        settings["hop_limit"] = 0  # stays on this machine
    try:
        if channel.interface == "socketcan":
            return BurstBus(channel.name, **settings)
        return can.Bus(interface=channel.interface, channel=channel.name, **settings)
    except (can.CanError, OSError, ValueError, ImportError) as error:
        number = error.errno if isinstance(error, OSError) else None
        reason = _REASONS.get(number) or str(error).rstrip(".") or type(error).__name__
        raise BusError(f"Bus {channel} cannot be opened ({reason}); {_HINT}.") from error


def send_all(bus: can.BusABC, frames: Sequence[can.Message]) -> None:
    """Send frames in their order, together where the bus can.

    Raises:
        can.CanError: the bus does not send one of them; those before it have been given to it.
    """
    if isinstance(bus, BurstBus):
        bus.send_all(frames)
    else:
        for frame in frames:
            bus.send(frame)


def next_frame(bus: can.BusABC, timing: CycleTiming) -> can.Message | None:
    """The next frame of a cycle; None where none comes while there is time for it.

    The clock is read only where there may be something to wait for.

    Raises:
        can.CanError: the bus does not receive.
    """
    if isinstance(bus, BurstBus) and bus.has_arrived:
        return bus.recv(0.0)
    return bus.recv(max(0.0, timing.remaining()))


def heard_within(bus: can.BusABC, patience_s: float) -> Iterator[can.Message]:
    """Frames that come within a time [s], and whatever has arrived when it is over.

    Where this program stood still meanwhile, nobody was silent.

    Raises:
        can.CanError: the bus does not receive.
    """
    end_s = time.monotonic() + patience_s
    while True:
        left_s = end_s - time.monotonic()
        frame = bus.recv(max(0.0, left_s))
        if frame is not None:
            yield frame
        elif left_s <= 0.0:
            return
