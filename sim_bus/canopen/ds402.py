"""The state machine of a drive (CiA 402-2, chapter 8.4)."""

from enum import IntEnum, IntFlag

CYCLIC_SYNCHRONOUS_TORQUE = 10


class State(IntEnum):
    """The states, by the bits 0-3, 5 and 6 that the statusword shows in them."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Statusword(IntFlag):
    """The other bits of the statusword."""

    VOLTAGE_ENABLED = 0x0010
    WARNING = 0x0080
    REMOTE = 0x0200
    INTERNAL_LIMIT = 0x0800
    FOLLOWS_COMMAND = 0x1000


_FAULT_RESET = 0x80


def follow(state: State, controlword: int, previous: int, can_reset: bool) -> State:
    """The state after a controlword.

    Args:
        state: the state before.
        controlword: the controlword, which acts by its level.
        previous: the controlword before it; a fault is reset by a rising edge of bit 7 only.
        can_reset: whether the cause of a fault has gone.
    """
    if state == State.FAULT:
        rising = controlword & ~previous & _FAULT_RESET
        return State.SWITCH_ON_DISABLED if rising and can_reset else state
    if state == State.NOT_READY_TO_SWITCH_ON or state == State.FAULT_REACTION_ACTIVE:
        return state
    if not controlword & 0x02:  # disable voltage: 7, 9, 10, 12
        return State.SWITCH_ON_DISABLED
    if not controlword & 0x04:  # quick stop: 7, 10, 11
        enabled = state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
        return State.QUICK_STOP_ACTIVE if enabled else State.SWITCH_ON_DISABLED
    return _switch(state, controlword)


def _switch(state: State, controlword: int) -> State:
    """Shutdown, switch on, disable and enable operation."""
    if state == State.QUICK_STOP_ACTIVE:  # 16
        return State.OPERATION_ENABLED if controlword & 0x0F == 0x0F else state
    if not controlword & 0x01:  # shutdown: 2, 6, 8
        return State.READY_TO_SWITCH_ON
    if state == State.SWITCH_ON_DISABLED:
        return state
    if controlword & 0x08:  # enable operation: 4, or 3 and 4 in one
        return State.OPERATION_ENABLED
    return State.SWITCHED_ON  # switch on, or disable operation: 3, 5
