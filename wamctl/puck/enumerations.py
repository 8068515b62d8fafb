"""The values of Puck properties that have names, and the groups of the bus."""

from enum import IntEnum

HOST = 0


class Group(IntEnum):
    """Receivers of group frames that this program uses (libbarrett `puck_group.h`)."""

    ALL_ACTUATORS = 0
    LOWER_TORQUES = 1
    UPPER_TORQUES = 2
    POSITION_FEEDBACK = 3
    WHOLE_ARM = 4
    PROPERTY_FEEDBACK = 6


class Status(IntEnum):
    """STAT; in RESET the monitor runs, which answers few properties."""

    RESET = 0
    ERR = 1
    READY = 2


class MotorMode(IntEnum):
    """MODE of a motor Puck; IDLE shorts the phases, brakes and ignores torque."""

    IDLE = 0
    DUTY = 1
    TORQUE = 2
    PID = 3
    VELOCITY = 4
    TRAPEZOIDAL = 5


class SafetyMode(IntEnum):
    """MODE of the safety Puck, which the host may only lower."""

    ESTOP = 0
    IDLE = 1
    ACTIVE = 2


class Role(IntEnum):
    """Low five bits of ROLE."""

    TATER = 0
    GIMBALS = 1
    SAFETY = 2
    WRAPTOR = 3
    TRIGGER = 4
    BHAND = 5
    FORCE = 6


JOINT_ENCODER = 0x4000
"""Of the upper bits of ROLE: the Puck reads an encoder at its joint."""
