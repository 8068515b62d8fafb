"""The drive's states (CiA 402, power drive system): statusword to state, state to controlword."""

from enum import IntEnum


class State(IntEnum):
    """States of the power drive system; the value is the statusword under the state's own mask."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08

    @property
    def words(self) -> str:
        """The state's name as the standard prints it."""
        return self.name.replace("_", " ")


class Controlword(IntEnum):
    """Commands of the state machine: bits 7 and 3 to 0 of the controlword."""

    DISABLE_VOLTAGE = 0x00
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


class Goal(IntEnum):
    """Where the drives are to go."""

    DISABLED = 0
    ENABLED = 1


ENERGISED = frozenset({State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE})
FAULTY = frozenset({State.FAULT, State.FAULT_REACTION_ACTIVE})
TORQUE_MODE = 10
"""Cyclic synchronous torque, object 0x6060."""
TORQUE_MODE_BIT = 1 << 9
"""Cyclic synchronous torque in object 0x6502."""

_MASK_OF = {
    State.NOT_READY_TO_SWITCH_ON: 0x4F,
    State.SWITCH_ON_DISABLED: 0x4F,
    State.FAULT_REACTION_ACTIVE: 0x4F,
    State.FAULT: 0x4F,
}
_STATE_OF: tuple[State | None, ...] = tuple(
    next((s for s in State if word & _MASK_OF.get(s, 0x6F) == s), None) for word in range(128)
)

_TOWARDS_ENABLED = {
    State.SWITCH_ON_DISABLED: Controlword.SHUTDOWN,
    State.READY_TO_SWITCH_ON: Controlword.SWITCH_ON,
    State.SWITCHED_ON: Controlword.ENABLE_OPERATION,
    State.OPERATION_ENABLED: Controlword.ENABLE_OPERATION,
}


def state(statusword: int) -> State | None:
    """The state that a statusword shows; None where the standard has none for these bits."""
    return _STATE_OF[statusword & 0x7F]


def controlword(now: State | None, goal: Goal) -> Controlword:
    """The command that leads one step towards the goal.

    A faulty drive is never reset on the way: it stays where it is until someone asks for a reset.
    """
    if goal is Goal.DISABLED or now is None:
        return Controlword.DISABLE_VOLTAGE
    return _TOWARDS_ENABLED.get(now, Controlword.DISABLE_VOLTAGE)
