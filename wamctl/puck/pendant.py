"""The pendant as the safety module reports it in PEN (libbarrett `safety_module.cpp`)."""

from dataclasses import dataclass
from enum import IntEnum

from wamctl.puck.errors import FrameError


class Button(IntEnum):
    """PEN, bits 27 and 26: the button that is held."""

    ESTOP = 0
    ACTIVATE = 1
    IDLE = 2
    NONE = 3


class Light(IntEnum):
    """One of the five lights, three bits each: bit 0 safe, 1 warning, 2 fault."""

    SAFE = 1
    WARNING = 2
    FAULT = 4


LIGHTS = ("velocity", "torque", "voltage", "heartbeat", "other")


@dataclass(frozen=True)
class Pendant:
    """What the pendant shows.

    Attributes:
        button: the button that is held.
        activate_light: whether the light of Shift-Activate is on.
        idle_light: whether the light of Shift-Idle is on.
        segments: the lit segments of the display, one bit each.
        lights: the five lights in the order of `LIGHTS`.
    """

    button: Button
    activate_light: bool
    idle_light: bool
    segments: int
    lights: tuple[Light, ...]

    def lit(self, state: Light) -> tuple[str, ...]:
        """Names of the lights in this state."""
        return tuple(
            name for name, light in zip(LIGHTS, self.lights, strict=True) if light is state
        )


def decode_pendant(pen: int) -> Pendant:
    """The pendant from the value of PEN.

    Raises:
        FrameError: a light that is not in exactly one state.
    """
    fields = [pen >> 3 * i & 0b111 for i in range(len(LIGHTS))]
    odd = [name for name, field in zip(LIGHTS, fields, strict=True) if field not in tuple(Light)]
    if odd:
        raise FrameError(
            f"The safety module's PEN {pen & 0xFFFFFFFF:#010x} has no single state for "
            f"{', '.join(odd)}."
        )
    return Pendant(
        button=Button(pen >> 26 & 0b11),
        activate_light=bool(pen >> 25 & 1),
        idle_light=bool(pen >> 24 & 1),
        segments=pen >> 16 & 0xFF,
        lights=tuple(Light(field) for field in fields),
    )
