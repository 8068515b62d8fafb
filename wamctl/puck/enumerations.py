"""The values of Puck properties that have names, and the groups of the bus."""

from enum import IntEnum, IntFlag

HOST = 0


class Group(IntEnum):
    """Receivers of group frames (libbarrett `puck_group.h`)."""

    ALL_ACTUATORS = 0
    LOWER_TORQUES = 1
    UPPER_TORQUES = 2
    POSITION_FEEDBACK = 3
    WHOLE_ARM = 4
    HAND = 5
    PROPERTY_FEEDBACK = 6
    JOINT_ENCODER_FEEDBACK = 7
    TACTILE_TOP10 = 8
    TACTILE_FULL = 9
    FORCE = 10
    TORQUE = 11
    ACCELERATION = 12


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


class RoleOption(IntFlag):
    """Upper bits of ROLE."""

    MAGNETIC_ENCODER_ON_SERIAL = 0x0100
    MAGNETIC_ENCODER_ON_HALL = 0x0200
    MAGNETIC_ENCODER_ON_ENC = 0x0400
    STRAIN = 0x0800
    TACTILE = 0x1000
    IMU = 0x2000
    JOINT_ENCODER = 0x4000
