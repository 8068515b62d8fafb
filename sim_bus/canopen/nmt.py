"""Network management: states and commands of a node (CiA 301)."""

from enum import IntEnum


class Nmt(IntEnum):
    """States of network management, as the heartbeat shows them."""

    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class Command(IntEnum):
    """Commands of network management."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82
