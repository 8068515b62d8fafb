"""Errors of a drive: emergency messages, error register, error history (CiA 301, chapter 7.2.7)."""

import struct
from enum import IntEnum, IntFlag

from sim_bus.canopen.dictionary import ObjectDictionary

_EMCY = struct.Struct("<HB5x")
_HISTORY = 8


class Register(IntFlag):
    """Bits of the error register 0x1001."""

    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


class ErrorCode(IntEnum):
    """Error codes that this drive raises by itself."""

    NONE = 0x0000
    UNDER_VOLTAGE = 0x3220
    SYNC_LOSS = 0x8700
    PDO_TOO_SHORT = 0x8210
    PDO_TOO_LONG = 0x8220
    BUS_OFF_RECOVERED = 0x8140


_REGISTERS = {
    0x2: Register.CURRENT,
    0x3: Register.VOLTAGE,
    0x4: Register.TEMPERATURE,
    0x7: Register.PROFILE,
    0xF: Register.MANUFACTURER,
}


def register_bits(code: int) -> Register:
    """Bits of the error register for an error code (81xx, 82xx, 87xx: communication)."""
    if code >> 8 in (0x81, 0x82, 0x87):
        return Register.GENERIC | Register.COMMUNICATION
    return Register.GENERIC | _REGISTERS.get(code >> 12, Register.GENERIC)


class Errors:
    """The errors of a drive; 0x1001 and 0x1003 follow them.

    Attributes:
        present: codes of the errors that are present.
    """

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self.present: set[int] = set()

    def enter(self, code: int) -> bytes | None:
        """Emergency message for an error; None when the error is present already."""
        if code in self.present:
            return None
        self.present.add(code)
        self._update_register()
        values = self._objects.values
        count = min(values[0x1003, 0] + 1, _HISTORY)
        for k in range(count, 1, -1):
            values[0x1003, k] = values[0x1003, k - 1]
        values[0x1003, 1] = code
        values[0x1003, 0] = count
        return _EMCY.pack(code, values[0x1001, 0])

    def leave(self, code: int) -> bytes | None:
        """Emergency message `error reset` when the last present error goes; else None."""
        if code not in self.present:
            return None
        self.present.remove(code)
        self._update_register()
        return None if self.present else _EMCY.pack(ErrorCode.NONE, 0)

    def leave_all(self) -> bytes | None:
        """As `leave`, for all errors at once."""
        had, self.present = bool(self.present), set()
        self._update_register()
        return _EMCY.pack(ErrorCode.NONE, 0) if had else None

    def clear_history(self) -> None:
        """Empty 0x1003."""
        for k in range(_HISTORY + 1):
            self._objects.values[0x1003, k] = 0

    def _update_register(self) -> None:
        register = 0
        for code in self.present:
            register |= register_bits(code)
        self._objects.values[0x1001, 0] = register
