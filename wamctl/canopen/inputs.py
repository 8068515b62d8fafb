"""What the drives say of their surroundings: temperatures, and the stop switch at one of them."""

import struct

from wamctl.arm.config import CanopenDrivesSection
from wamctl.canopen import pdo

_TEMPERATURES = struct.Struct("<hh")  # amplifier, motor [0.1 deg C]
_DIGITAL = struct.Struct("<I")


class Inputs:
    """Watches temperatures and the stop switch.

    Args:
        drives: limits, and where the switch is.
        names: what to call each drive.
        patience: cycles without the switch's state after which the arm is stopped.
    """

    def __init__(self, drives: CanopenDrivesSection, names: tuple[str, ...], patience: int) -> None:
        self._limit_c = drives.temperature_limit_c
        self._temperatures = {
            pdo.temperature_id(node): name
            for node, name in zip(drives.node_ids, names, strict=True)
            if self._limit_c is not None
        }
        self._switch = drives.stop_input
        self._switch_id = pdo.stop_input_id(self._switch.node_id) if self._switch else None
        self._patience = patience
        self._unheard = 0
        self._reason: str | None = None

    def start(self) -> None:
        """Forget what was heard."""
        self._unheard, self._reason = 0, None

    def hear(self, can_id: int, data: bytes | bytearray) -> bool:
        """Take in a frame; False if it carries none of these inputs."""
        if can_id == self._switch_id and len(data) == _DIGITAL.size:
            self._hear_switch(_DIGITAL.unpack(data)[0])
            return True
        if can_id in self._temperatures and len(data) == _TEMPERATURES.size:
            self._hear_temperatures(self._temperatures[can_id], *_TEMPERATURES.unpack(data))
            return True
        return False

    def reason(self) -> str | None:
        """Why the arm should stop, though the drives can be trusted; to be asked once a cycle."""
        if self._switch is not None:
            self._unheard += 1
            if self._unheard > self._patience:
                self._note(f"the stop switch was not heard of for {self._unheard} cycles")
        return self._reason

    def _hear_switch(self, inputs: int) -> None:
        self._unheard = 0
        if self._switch is not None and inputs >> self._switch.bit & 1 == self._switch.stops_at:
            self._note("the stop switch was pressed")

    def _hear_temperatures(self, name: str, amplifier: int, motor: int) -> None:
        for part, tenths in (("amplifier", amplifier), ("motor", motor)):
            if self._limit_c is not None and tenths > 10 * self._limit_c:
                self._note(
                    f"{part} of {name} has {tenths / 10:.1f} deg C, above its limit of "
                    f"{self._limit_c:.1f} deg C"
                )

    def _note(self, reason: str) -> None:
        self._reason = self._reason or reason
