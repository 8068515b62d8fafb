"""Process data: which PDOs carry the cycle, for both wirings, and their bytes (CiA 301, PDO)."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import can

from wamctl.arm.config import CanopenDrivesSection
from wamctl.canopen import dictionary as od
from wamctl.canopen import identifiers as ids
from wamctl.canopen.dictionary import Object
from wamctl.canopen.ds402 import TORQUE_MODE

EVERY_SYNC, ON_ARRIVAL = 1, 255
PDOS_PER_DRIVE = 4
GROUP_SIZE = 4
_TEMPERATURE_MS, _STAGGER_MS = 500, 13  # not all drives in the same cycle
_INVALID = 1 << 31
_NO_RTR = 1 << 30

POSITION_FRAME = struct.Struct("<Hi")  # statusword, position [counts]
_TORQUE_GROUP = struct.Struct("<4h")  # [per mille of 0x6076]
_COMMAND = struct.Struct("<Hb")  # controlword, mode
_COMMAND_AND_TORQUE = struct.Struct("<Hh")


@dataclass(frozen=True)
class Pdo:
    """One PDO of a drive.

    Attributes:
        cob_id: its identifier.
        transmission: its type.
        entries: the mapped objects.
        event_ms: it is sent this often, where its type is `ON_ARRIVAL` [ms].
    """

    cob_id: int
    transmission: int
    entries: tuple[Object, ...]
    event_ms: int = 0

    @property
    def length(self) -> int:
        """Data bytes."""
        return sum(entry.bits for entry in self.entries) // 8


@dataclass(frozen=True)
class Wiring:
    """The PDOs that a drive receives and sends; those not listed are switched off."""

    received: tuple[Pdo, ...]
    sent: tuple[Pdo, ...]


def wiring(drives: CanopenDrivesSection, slot: int) -> Wiring:
    """The PDOs of the drive at a place (0, 1, ...) in the configuration.

    Torque frames are of type 1: what is sent after one SYNC is applied by all drives together at
    the next, so that the master's jitter does not reach the arm. A stop must not wait for that:
    each has a twin of type 255, applied on arrival.
    """
    return Wiring(_received(drives, slot), _sent(drives, slot))


def _sent(drives: CanopenDrivesSection, slot: int) -> tuple[Pdo, ...]:
    node, switch = drives.node_ids[slot], drives.stop_input
    sent = [Pdo(position_id(node), EVERY_SYNC, (od.STATUSWORD, od.POSITION))]
    if drives.temperature_limit_c is not None:
        temperatures = (od.AMPLIFIER_TEMPERATURE, od.MOTOR_TEMPERATURE)
        staggered_ms = _TEMPERATURE_MS + _STAGGER_MS * slot
        sent.append(Pdo(temperature_id(node), ON_ARRIVAL, temperatures, staggered_ms))
    if switch is not None and switch.node_id == node:
        sent.append(Pdo(stop_input_id(node), EVERY_SYNC, (od.DIGITAL_INPUTS,)))
    return tuple(sent)


def _received(drives: CanopenDrivesSection, slot: int) -> tuple[Pdo, ...]:
    node = drives.node_ids[slot]
    if drives.wiring == "pdo_per_drive":
        both = od.CONTROLWORD, od.TARGET_TORQUE
        return tuple(
            Pdo(cob_id + node, kind, both)
            for cob_id, kind in zip(ids.RECEIVE_PDO, (EVERY_SYNC, ON_ARRIVAL), strict=False)
        )
    group, place = divmod(slot, GROUP_SIZE)
    entries = [od.DUMMY_I16] * GROUP_SIZE
    entries[place] = od.TARGET_TORQUE
    at_sync, on_arrival = _group_ids(drives)[group]
    return (
        Pdo(at_sync, EVERY_SYNC, tuple(entries)),
        Pdo(command_id(node), ON_ARRIVAL, (od.CONTROLWORD, od.MODE)),
        Pdo(on_arrival, ON_ARRIVAL, tuple(entries)),
    )


def _group_ids(drives: CanopenDrivesSection) -> list[tuple[int, int]]:
    """COB-IDs of each shared torque frame and of its twin: PDOs of node 0, which no drive has."""
    groups = -(-len(drives.node_ids) // GROUP_SIZE)
    free = (*ids.RECEIVE_PDO, *ids.TRANSMIT_PDO[1:])  # CiA 301 reserves 0x180
    return list(zip(free[:groups], free[groups : 2 * groups], strict=True))


def command_id(node: int) -> int:
    """COB-ID of a drive's controlword alone: that of its RPDO2."""
    return ids.RECEIVE_PDO[1] + node


def position_id(node: int) -> int:
    """COB-ID of a drive's statusword and position: that of its TPDO1."""
    return ids.TRANSMIT_PDO[0] + node


def temperature_id(node: int) -> int:
    """COB-ID of a drive's temperatures: that of its TPDO2."""
    return ids.TRANSMIT_PDO[1] + node


def stop_input_id(node: int) -> int:
    """COB-ID of the digital inputs of the drive with the stop switch: that of its TPDO3."""
    return ids.TRANSMIT_PDO[2] + node


def received_ids(drives: CanopenDrivesSection) -> set[int]:
    """COB-IDs of all PDOs that the drives receive."""
    slots = range(len(drives.node_ids))
    return {p.cob_id for slot in slots for p in wiring(drives, slot).received}


def settings(wanted: Wiring, node: int) -> list[tuple[Object, int]]:
    """Writes, in order, that give a drive its PDOs (PRE-OPERATIONAL only).

    Order of CiA 301: PDO off, mapping emptied, filled and closed, type, PDO on.
    """
    writes = []
    for communication, mapping, defaults, pdos in (
        (0x1400, 0x1600, ids.RECEIVE_PDO, wanted.received),
        (0x1800, 0x1A00, ids.TRANSMIT_PDO, wanted.sent),
    ):
        for number in range(PDOS_PER_DRIVE):
            pdo = pdos[number] if number < len(pdos) else None
            off = (pdo.cob_id if pdo else defaults[number] + node) | _INVALID
            flags = _NO_RTR if communication == 0x1800 else 0
            writes.append((Object(communication + number, 1), off | flags))
            if pdo is None:
                continue
            entries = [
                (Object(mapping + number, i), e.mapping) for i, e in enumerate(pdo.entries, 1)
            ]
            writes += [(Object(mapping + number, 0), 0), *entries]
            writes.append((Object(mapping + number, 0), len(entries)))
            writes.append((Object(communication + number, 2), pdo.transmission))
            if pdo.event_ms:
                writes.append((Object(communication + number, 5), pdo.event_ms))
            writes.append((Object(communication + number, 1), pdo.cob_id | flags))
    return writes


class GroupFrames:
    """Commands and torques as shared torque frames; controlwords travel alone, on change."""

    def __init__(self, drives: CanopenDrivesSection, fd: bool) -> None:
        pairs = _group_ids(drives)
        self._torques, self._twins = _in_pairs(pairs, _TORQUE_GROUP.size, fd)
        self._padding = (0,) * (len(pairs) * GROUP_SIZE - len(drives.node_ids))
        self._commands = [message(command_id(node), _COMMAND.size, fd) for node in drives.node_ids]

    def command(self, slot: int, controlword: int) -> can.Message | None:
        """The frame that gives one drive its controlword at once."""
        frame = self._commands[slot]
        _COMMAND.pack_into(frame.data, 0, controlword, TORQUE_MODE)
        return frame

    def torques(self, permille: Sequence[int], controlwords: Sequence[int]) -> list[can.Message]:
        """The cycle's torque frames, for torques in per mille of each drive's rated torque."""
        padded = (*permille, *self._padding)
        for i, frame in enumerate(self._torques):
            _TORQUE_GROUP.pack_into(frame.data, 0, *padded[GROUP_SIZE * i : GROUP_SIZE * (i + 1)])
        return self._torques

    def twins(self) -> list[can.Message]:
        """The same torques, to be applied on arrival."""
        return _filled(self._twins, self._torques)


class DriveFrames:
    """Commands and torques as one frame for each drive."""

    def __init__(self, drives: CanopenDrivesSection, fd: bool) -> None:
        at_sync, on_arrival = ids.RECEIVE_PDO[:2]
        pairs = [(at_sync + node, on_arrival + node) for node in drives.node_ids]
        self._frames, self._twins = _in_pairs(pairs, _COMMAND_AND_TORQUE.size, fd)

    def command(self, slot: int, controlword: int) -> can.Message | None:
        """None: the controlword goes with the next torque."""
        return None

    def torques(self, permille: Sequence[int], controlwords: Sequence[int]) -> list[can.Message]:
        """The cycle's frames, for torques in per mille of each drive's rated torque."""
        for frame, word, torque in zip(self._frames, controlwords, permille, strict=True):
            _COMMAND_AND_TORQUE.pack_into(frame.data, 0, word, torque)
        return self._frames

    def twins(self) -> list[can.Message]:
        """The same controlwords and torques, to be applied on arrival."""
        return _filled(self._twins, self._frames)


def _in_pairs(
    pairs: Sequence[tuple[int, int]], length: int, fd: bool
) -> tuple[list[can.Message], list[can.Message]]:
    """Frames that are applied at SYNC, and their twins."""
    made = [(message(a, length, fd), message(b, length, fd)) for a, b in pairs]
    return [frame for frame, _ in made], [twin for _, twin in made]


def _filled(twins: list[can.Message], frames: list[can.Message]) -> list[can.Message]:
    for twin, frame in zip(twins, frames, strict=True):
        twin.data[:] = frame.data
    return twins


def frames(drives: CanopenDrivesSection, fd: bool) -> GroupFrames | DriveFrames:
    """The encoder of the configured wiring."""
    return GroupFrames(drives, fd) if drives.wiring == "group_pdos" else DriveFrames(drives, fd)


def message(cob_id: int, length: int, fd: bool) -> can.Message:
    """A frame to be filled and sent again and again.

    Args:
        cob_id: its identifier.
        length: data bytes.
        fd: a CAN FD frame with bit-rate switch.
    """
    return can.Message(
        arbitration_id=cob_id,
        is_extended_id=False,
        data=bytearray(length),
        is_fd=fd,
        bitrate_switch=fd,
        check=True,
    )
