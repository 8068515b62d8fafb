"""Length of a frame on the wire: exact, with stuff bits and checksum (ISO 11898-1)."""

from dataclasses import dataclass

from sim_bus.can_bus.frame import EXTENDED, FD_LENGTHS, REMOTE, Frame, carried_length
from wamctl.arm.compilation import compiled

GAP_BITS = 3
"""Intermission behind a frame, before the next one may start."""

_CRC15 = 0x4599
_CLASSIC_TAIL = 10  # CRC delimiter, acknowledge slot and its delimiter, end of frame
_FD_TAIL = 10


@dataclass(frozen=True)
class BitTiming:
    """Bit rates of a bus.

    Attributes:
        nominal_bit_s: of classic frames, and of arbitration and end of CAN FD frames [bit/s].
        data_bit_s: of the data phase of CAN FD frames [bit/s].
    """

    nominal_bit_s: float
    data_bit_s: float


def frame_ns(frame: Frame, timing: BitTiming) -> int:
    """Time [ns] from start of frame to its last bit; the gap behind it is not counted."""
    if not frame.fd:
        return round(classic_frame_bits(frame) * 1e9 / timing.nominal_bit_s)
    slow, fast = fd_frame_bits(frame)
    return round(slow * 1e9 / timing.nominal_bit_s + fast * 1e9 / timing.data_bit_s)


def warm_up(timing: BitTiming) -> None:
    """Compile what counts the bits, before a clock runs."""
    for fd in (False, True):
        frame_ns(Frame(0, b"", fd), timing)


def classic_frame_bits(frame: Frame) -> int:
    """Bits of a classic frame up to its last one: 44 + 8 n for n data bytes, and the stuff bits."""
    extended, remote = bool(frame.can_id & EXTENDED), bool(frame.can_id & REMOTE)
    can_id = frame.can_id & 0x1FFF_FFFF
    return _classic_bits(can_id, extended, remote, frame.data, len(frame.data)) + _CLASSIC_TAIL


def fd_frame_bits(frame: Frame) -> tuple[int, int]:
    """Bits of a CAN FD frame: those at the nominal rate, and those at the data rate."""
    length = carried_length(len(frame.data), fd=True)
    code = FD_LENGTHS.index(length)
    data = frame.data.ljust(length, b"\0")
    slow, fast = _fd_bits(frame.can_id & 0x7FF, code, data, length)
    return slow + _FD_TAIL, fast


@compiled
def _classic_bits(can_id: int, extended: bool, remote: bool, data: bytes, length: int) -> int:
    """From the start of frame to the end of the checksum."""
    bits = [0]
    if extended:
        _append(bits, can_id >> 18, 11)
        _append(bits, 3, 2)
        _append(bits, can_id, 18)
    else:
        _append(bits, can_id, 11)
    _append(bits, int(remote), 1)
    _append(bits, 0, 2)
    _append(bits, length, 4)
    for k in range(0 if remote else length):
        _append(bits, data[k], 8)
    _append(bits, _crc15(bits), 15)
    return len(bits) + _stuff_bits(bits, 0, len(bits))


@compiled
def _fd_bits(can_id: int, code: int, data: bytes, length: int) -> tuple[int, int]:
    """Bits before the bit-rate switch, and from there to the end of the checksum."""
    bits = [0]
    _append(bits, can_id, 11)
    _append(bits, 0b00101, 5)
    slow = len(bits)
    _append(bits, code, 5)
    for k in range(length):
        _append(bits, data[k], 8)
    stuffed_slow = _stuff_bits(bits, 0, slow)
    stuffed_fast = _stuff_bits(bits, 0, len(bits)) - stuffed_slow
    checksum = 17 if length <= 16 else 21
    fixed_stuff = (4 + checksum + 3) // 4
    return slow + stuffed_slow, len(bits) - slow + stuffed_fast + 4 + checksum + fixed_stuff


@compiled
def _append(bits: list[int], value: int, width: int) -> None:
    for shift in range(width - 1, -1, -1):
        bits.append((value >> shift) & 1)


@compiled
def _crc15(bits: list[int]) -> int:
    crc = 0
    for bit in bits:
        feed = bit ^ ((crc >> 14) & 1)
        crc = (crc << 1) & 0x7FFF
        if feed:
            crc ^= _CRC15
    return crc


@compiled
def _stuff_bits(bits: list[int], start: int, stop: int) -> int:
    """Stuff bits among `bits[start:stop]`: one of the other value after every five equal ones."""
    count, run, last = 0, 0, -1
    for k in range(start, stop):
        run = run + 1 if bits[k] == last else 1
        last = bits[k]
        if run == 5:
            count += 1
            last, run = 1 - last, 1
    return count
