"""What an emergency message means (CiA 301, EMCY; CiA 402 and Puck 4 codes)."""

import struct
from dataclasses import dataclass

_FRAME = struct.Struct("<HB5s")

MEANINGS = {
    0x1000: "generic error",
    0x2310: "over-current, i2t limit",
    0x2311: "current near the magnets' demagnetisation",
    0x2320: "short circuit",
    0x3110: "mains voltage",
    0x3210: "bus over-voltage",
    0x3220: "bus under-voltage",
    0x4210: "amplifier over-temperature",
    0x4310: "motor over-temperature",
    0x5000: "device hardware",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7122: "commutation (phasing) error",
    0x7305: "sensor error",
    0x7310: "speed error",
    0x7320: "position sensor",
    0x7321: "encoder magnet distance",
    0x8100: "communication",
    0x8110: "CAN overrun, frames were lost",
    0x8120: "CAN error passive",
    0x8130: "heartbeat lost",
    0x8140: "recovered from bus-off",
    0x8150: "two senders of one COB-ID",
    0x8210: "PDO too short, not processed",
    0x8220: "PDO too long",
    0x8240: "SYNC of a wrong length",
    0x8250: "RPDO came too late",
    0x8300: "torque control",
    0x8411: "velocity warning",
    0x8414: "velocity fault",
    0x8418: "velocity limit",
    0x8500: "position control",
    0x8611: "following error",
    0x8613: "position limit",
    0x8614: "position fault",
    0x8700: "SYNC lost",
}
_FAMILIES = {
    0x1: "generic error",
    0x2: "current",
    0x3: "voltage",
    0x4: "temperature",
    0x5: "device hardware",
    0x6: "device software",
    0x7: "additional modules",
    0x8: "monitoring",
    0x9: "external error",
    0xF: "additional functions",
}


@dataclass(frozen=True)
class Emergency:
    """One emergency message of a drive; `code` zero says that its errors are gone."""

    code: int
    register: int
    vendor: bytes

    def __str__(self) -> str:
        return f"EMCY 0x{self.code:04X}, {meaning(self.code)}"


def meaning(code: int) -> str:
    """The code in words; codes that no table lists are named by their family."""
    if code >> 8 == 0:
        return "no error"
    return MEANINGS.get(code) or f"{_FAMILIES.get(code >> 12, 'unknown')} (unlisted code)"


def emergency(data: bytes | bytearray) -> Emergency | None:
    """The content of an EMCY frame; None unless it has its eight bytes."""
    return Emergency(*_FRAME.unpack(data)) if len(data) == _FRAME.size else None
