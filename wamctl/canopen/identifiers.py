"""The predefined connection set: which identifier carries which service (CiA 301, 7.3.3)."""

from collections.abc import Iterable

NMT = 0x000
SYNC = 0x080
EMERGENCY = 0x080
"""Plus the drive's node, as for all that follow."""
TRANSMIT_PDO = (0x180, 0x280, 0x380, 0x480)
RECEIVE_PDO = (0x200, 0x300, 0x400, 0x500)
SDO_ANSWER = 0x580
SDO_REQUEST = 0x600
HEARTBEAT = 0x700

SERVICE, NODE = 0x780, 0x07F
"""Masks of the two parts of an identifier."""
MASTER_NODE = 0x7F
MASTER_HEARTBEAT = HEARTBEAT + MASTER_NODE


def of_master(node_ids: Iterable[int]) -> set[int]:
    """Identifiers that only a master of these nodes sends, process data apart."""
    return {NMT, SYNC, MASTER_HEARTBEAT} | {SDO_REQUEST + node for node in node_ids}
