"""Service data: reading and checked writing of a drive's objects (CiA 301, SDO, expedited)."""

import struct
from dataclasses import dataclass

import can
from canopen import ObjectDictionary, SdoAbortedError
from canopen.objectdictionary import ODVariable

from wamctl.canopen import identifiers as ids
from wamctl.canopen.dictionary import Object
from wamctl.drives.bus import heard_within
from wamctl.errors import BusError, SilentDriveError

_ATTEMPTS = 3
_PATIENCE_S = 0.3
_HEAD = struct.Struct("<BHB")  # command, object: before up to four bytes of data
_UPLOAD, _DOWNLOAD, _ABORT = 0x40, 0x22, 0x80
_UPLOADED, _DOWNLOADED = 0x40, 0x60
_SERVICE, _EXPEDITED, _SIZED = 0xE0, 0x02, 0x01  # parts of a command
_LENGTHS = {
    ids.EMERGENCY: (0, 8),  # or SYNC
    ids.SDO_ANSWER: (8,),
    ids.SDO_REQUEST: (8,),
    ids.HEARTBEAT: (1,),
}


@dataclass(frozen=True)
class Node:
    """A drive whose objects are read and written while nobody else reads the bus.

    Attributes:
        bus: the open bus.
        number: of the node.
        dictionary: its objects.
    """

    bus: can.BusABC
    number: int
    dictionary: ObjectDictionary


def is_data(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier."""
    return not (message.is_extended_id or message.is_remote_frame or message.is_error_frame)


def is_plain(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier and a length that its service allows."""
    if not is_data(message):
        return False
    lengths = _LENGTHS.get(message.arbitration_id & ids.SERVICE)
    return lengths is None or len(message.data) in lengths


def read(node: Node, wanted: Object) -> int:
    """The value of an object.

    Raises:
        BusError: no answer, or an abort; the message says which object and why.
    """
    variable = _variable(node, wanted)
    answer = _answer(node, wanted, _UPLOAD, b"", _UPLOADED)
    command, length = answer[0], len(variable) // 8
    unused = command >> 2 & 3 if command & _SIZED else 0
    given = 4 - unused if command & _EXPEDITED else 0
    if given < length:
        raise BusError(f"object {wanted} came with {given} bytes instead of {length}")
    return int(variable.decode_raw(answer[4 : 4 + length]))


def write(node: Node, wanted: Object, value: int) -> None:
    """Set an object and read it back.

    Raises:
        BusError: as for `read`, or the drive kept another value.
    """
    data = _variable(node, wanted).encode_raw(value)
    _answer(node, wanted, _DOWNLOAD | _SIZED | (4 - len(data)) << 2, data, _DOWNLOADED)
    kept = read(node, wanted)
    if kept != value:
        raise BusError(f"object {wanted} was set to {value:#x} and reads back as {kept:#x}")


def _variable(node: Node, wanted: Object) -> ODVariable:
    found = node.dictionary.get_variable(wanted.index, wanted.subindex)
    if found is None:
        raise BusError(f"object {wanted} is not in the drive's dictionary file")
    return found


def _answer(node: Node, wanted: Object, command: int, data: bytes, service: int) -> bytes:
    """The drive's answer to a question, eight bytes.

    Answers that came before the question are left out, and those to another one passed over: where
    this program, the bus or the drive was held up, each repeated question has its own answer. What
    has arrived is received before the drive is called silent.
    """
    question = _HEAD.pack(command, wanted.index, wanted.subindex) + data.ljust(4, b"\0")
    sent = can.Message(
        arbitration_id=ids.SDO_REQUEST + node.number, data=question, is_extended_id=False
    )
    try:
        while node.bus.recv(0.0) is not None:
            pass
        for _ in range(_ATTEMPTS):
            node.bus.send(sent)
            for frame in heard_within(node.bus, _PATIENCE_S):
                heard = bytes(frame.data)
                if frame.arbitration_id != ids.SDO_ANSWER + node.number or not is_plain(frame):
                    continue
                if heard[1:4] != question[1:4]:
                    continue
                if heard[0] == _ABORT:
                    reason = SdoAbortedError(int.from_bytes(heard[4:], "little"))
                    raise BusError(f"object {wanted} was refused ({reason})")
                if heard[0] & _SERVICE == service:
                    return heard
    except (can.CanError, OSError) as error:
        raise BusError(f"the question about object {wanted} failed ({error})") from error
    raise SilentDriveError(
        f"no answer about object {wanted} within {_PATIENCE_S:g} s, {_ATTEMPTS} times"
    )
