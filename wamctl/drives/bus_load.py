"""How full the wire is: the time of each frame with its stuff bits, and a plan's share of it."""

from collections.abc import Sequence
from dataclasses import dataclass

from wamctl.arm.config import BusSection

HIGHEST_LOAD = 0.8
"""Plans above this share of the bus are refused: SDO, EMCY and retransmissions need the rest."""

_FD_LENGTHS = (8, 12, 16, 20, 24, 32, 48, 64)


@dataclass(frozen=True)
class Traffic:
    """Frames of one kind: how many a second, and their data bytes."""

    name: str
    per_second: float
    length: int


@dataclass(frozen=True)
class Load:
    """How much of the bus a plan takes.

    Attributes:
        traffic: all frames.
        nominal: share of the bus without stuff bits, 0 to 1.
        worst: the same with the most stuff bits.
        answer_us: from the cycle's first frame to the end of the last position, without stuff
            bits [us].
        cycle_us: all frames of one cycle with the most stuff bits [us].
    """

    traffic: tuple[Traffic, ...]
    nominal: float
    worst: float
    answer_us: float
    cycle_us: float


def load(
    bus: BusSection, asking: Sequence[Traffic], torques: Sequence[Traffic], aside: Sequence[Traffic]
) -> Load:
    """The load of a plan.

    Args:
        bus: bit rates.
        asking: what opens a cycle, and the positions that answer it.
        torques: what ends it.
        aside: what comes now and then.
    """
    traffic = (*asking, *torques, *aside)
    return Load(
        traffic,
        sum(t.per_second * frame_s(bus, t.length) for t in traffic),
        sum(t.per_second * stuffed_frame_s(bus, t.length) for t in traffic),
        sum(frame_s(bus, t.length) for t in asking) * 1e6,
        sum(stuffed_frame_s(bus, t.length) for t in (*asking, *torques)) * 1e6,
    )


def faults(found: Load) -> list[str]:
    """Why a plan cannot be carried; empty where it can."""
    if found.worst <= HIGHEST_LOAD:
        return []
    return [
        f"bus: the plan takes {found.worst:.0%} of it with the most stuff bits "
        f"({found.nominal:.0%} without any), above the limit of {HIGHEST_LOAD:.0%}: take shared "
        "torque frames (drives.wiring: group_pdos), a longer bus.period_s, or CAN FD "
        "(bus.data_bitrate_bit_s)"
    ]


def frame_s(bus: BusSection, length: int) -> float:
    """Time of a frame with an 11-bit identifier and the gap after it, without stuff bits [s].

    Args:
        bus: bit rates.
        length: data bytes.
    """
    slow, fast = _bits(bus, length)
    return slow / bus.bitrate_bit_s + fast / (bus.data_bitrate_bit_s or bus.bitrate_bit_s)


def stuffed_frame_s(bus: BusSection, length: int) -> float:
    """The same with the largest number of stuff bits [s]."""
    if bus.data_bitrate_bit_s is None:
        return frame_s(bus, length) + (33 + 8 * length) // 4 / bus.bitrate_bit_s
    # From the identifier to the bit-rate switch, and on to the last data byte.
    head, body = 17 // 4, (5 + 8 * _padded(length)) // 4
    return frame_s(bus, length) + head / bus.bitrate_bit_s + body / bus.data_bitrate_bit_s


def _bits(bus: BusSection, length: int) -> tuple[int, int]:
    """Bits at the nominal and at the data bit rate."""
    if bus.data_bitrate_bit_s is None:
        return 47 + 8 * length, 0
    padded = _padded(length)
    checksum = 17 + 6 if padded <= 16 else 21 + 7  # with its fixed stuff bits
    return 17 + 12, 5 + 8 * padded + 4 + checksum + 1


def _padded(length: int) -> int:
    """Data bytes of the CAN FD frame that holds so many."""
    return length if length <= 8 else next(n for n in _FD_LENGTHS if n >= length)
