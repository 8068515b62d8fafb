"""Frame lengths against a second, plainer implementation and published bounds."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bus.can_bus.frame import EXTENDED, Frame
from sim_bus.can_bus.frame_length import BitTiming, classic_frame_bits, fd_frame_bits, frame_ns


def remainder(bits: str) -> str:
    """CRC-15 of a string of bits by long division."""
    polynomial = int("1100010110011001", 2)
    value = int(bits + "0" * 15, 2)
    for shift in range(len(bits) - 1, -1, -1):
        if value >> (shift + 15) & 1:
            value ^= polynomial << shift
    return f"{value:015b}"


def stuffed(bits: str) -> str:
    done, rest = "", bits
    while match := re.search(r"00000|11111", rest):
        other = "1" if rest[match.start()] == "0" else "0"
        done += rest[: match.end()]
        rest = other + rest[match.end() :]
    return done + rest


def plain_length(can_id: int, data: bytes) -> int:
    head = f"0{can_id:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    return len(stuffed(head + remainder(head))) + 10


def test_the_checksum_is_the_published_one():
    bits = "".join(f"{byte:08b}" for byte in b"123456789")
    assert int(remainder(bits), 2) == 0x059E  # CRC-15/CAN, check value


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
@settings(deadline=None)
def test_a_classic_frame_is_counted_bit_by_bit(can_id, data):
    assert classic_frame_bits(Frame(can_id, data)) == plain_length(can_id, data)


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
@settings(deadline=None)
def test_a_classic_frame_lies_between_its_bounds(can_id, data):
    n = len(data)
    bits = classic_frame_bits(Frame(can_id, data)) + 3
    assert 47 + 8 * n <= bits <= 47 + 8 * n + (33 + 8 * n) // 4


def test_an_extended_frame_is_longer_by_twenty_bits():
    # Alternating bits need no stuffing in the identifier.
    short = classic_frame_bits(Frame(0x555))
    long = classic_frame_bits(Frame(0x15555555 | EXTENDED))
    assert 18 <= long - short <= 22


def test_a_frame_takes_its_bits_in_microseconds():
    frame = Frame(0x181, b"\x37\x12\x01\x02\x03\x04")
    assert frame_ns(frame, BitTiming(1e6, 5e6)) == 1000 * classic_frame_bits(frame)
    assert frame_ns(frame, BitTiming(5e5, 5e6)) == 2000 * classic_frame_bits(frame)


@pytest.mark.parametrize(("length", "padded"), [(6, 6), (9, 12), (14, 16), (33, 48), (64, 64)])
def test_a_long_frame_is_padded_to_the_next_length(length, padded):
    odd = Frame(0x555, b"\x55" * length, True)
    even = Frame(0x555, b"\x55" * length + b"\0" * (padded - length), True)
    assert fd_frame_bits(odd) == fd_frame_bits(even)


def test_a_long_frame_sends_its_data_at_the_fast_rate():
    slow, fast = fd_frame_bits(Frame(0x555, b"\x55" * 16, True))
    assert 27 <= slow <= 30
    assert fast >= 5 + 16 * 8 + 4 + 17 + 6
    duration = frame_ns(Frame(0x555, b"\x55" * 16, True), BitTiming(1e6, 5e6))
    assert duration == slow * 1000 + fast * 200
