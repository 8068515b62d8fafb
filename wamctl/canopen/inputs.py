"""What the drives say of their surroundings: temperatures, and the stop switch at one of them."""

import struct

from wamctl.arm.config import CanopenDrivesSection
from wamctl.canopen import pdo

_TEMPERATURES = struct.Struct("<hh")  # amplifier, motor [0.1 deg C]
_DIGITAL = struct.Struct("<I")
_UNHEARD_CYCLES = 5  # without the stop switch's state


class Temperatures:
    """Watches the temperatures of amplifiers and motors.

    Args:
        drives: their limit; without one nothing is watched.
        names: what to call each drive.
    """

    def __init__(self, drives: CanopenDrivesSection, names: tuple[str, ...]) -> None:
        self._limit_c = drives.temperature_limit_c
        self._names = {
            pdo.temperature_id(node): name
            for node, name in zip(drives.node_ids, names, strict=True)
            if self._limit_c is not None
        }
        self._reason: str | None = None

    def start(self) -> None:
        """Forget what was heard."""
        self._reason = None

    def hear(self, can_id: int, data: bytes | bytearray) -> bool:
        """Take in a frame; False if it carries no temperatures of these drives."""
        if can_id not in self._names or len(data) != _TEMPERATURES.size:
            return False
        amplifier, motor = _TEMPERATURES.unpack(data)
        for part, tenths in (("amplifier", amplifier), ("motor", motor)):
            if self._limit_c is not None and tenths > 10 * self._limit_c:
                self._reason = self._reason or (
                    f"{part} of {self._names[can_id]} has {tenths / 10:.1f} deg C, above its "
                    f"limit of {self._limit_c:.1f} deg C"
                )
        return True

    def reason(self) -> str | None:
        """Why the arm should stop, though the drives can be trusted; None if it need not."""
        return self._reason


class StopInput:
    """Watches the stop switch at one of the drives.

    Args:
        drives: where the switch is; without one nothing is watched.
    """

    def __init__(self, drives: CanopenDrivesSection) -> None:
        self._switch = drives.stop_input
        self._can_id = pdo.stop_input_id(self._switch.node_id) if self._switch else None
        self.start()

    def start(self) -> None:
        """Forget what was heard."""
        self._unheard = 0
        self._reason: str | None = None

    def hear(self, can_id: int, data: bytes | bytearray) -> bool:
        """Take in a frame; False if it does not carry the switch's state."""
        if self._switch is None or can_id != self._can_id or len(data) != _DIGITAL.size:
            return False
        self._unheard = 0
        if _DIGITAL.unpack(data)[0] >> self._switch.bit & 1 == self._switch.stops_at:
            self._reason = self._reason or "the stop switch was pressed"
        return True

    def reason(self) -> str | None:
        """Why the arm should stop; None if it need not. To be asked once a cycle."""
        if self._switch is not None:
            self._unheard += 1
            if self._unheard > _UNHEARD_CYCLES and self._reason is None:
                self._reason = f"the stop switch was not heard of for {self._unheard} cycles"
        return self._reason
