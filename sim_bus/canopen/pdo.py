"""PDO parameters and mapping of a drive (CiA 301, chapters 7.2.2 and 7.5.2.34 to 7.5.2.38)."""

import struct
from dataclasses import dataclass

from sim_bus.canopen.dictionary import Abort, Getter, Key, ObjectDictionary, SdoAbort

RPDO_PARAMETER, RPDO_MAPPING = 0x1400, 0x1600
TPDO_PARAMETER, TPDO_MAPPING = 0x1800, 0x1A00
PDO_COUNT = 4
LAST_SYNCHRONOUS = 240

_INVALID = 0x8000_0000
_ID_BITS = 0x1FFF_FFFF
# Identifiers that no PDO may use (CiA 301, table 38), and SYNC.
_RESERVED = (
    (0x000, 0x080),
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x7FF),
)


Values = tuple[tuple[Key, int], ...]
"""Numbers that a PDO has brought, by their keys."""


@dataclass(frozen=True)
class Mapping:
    """The objects in a PDO, one after the other.

    Attributes:
        keys: entries, without dummies.
        getters: how to get their present values.
        layout: their packing; a dummy is padding.
    """

    keys: tuple[Key, ...]
    getters: tuple[Getter, ...]
    layout: struct.Struct

    def pack(self) -> bytes:
        """The present values."""
        return self.layout.pack(*[get() for get in self.getters])

    def unpack(self, data: bytes) -> Values:
        """The values that a PDO brings."""
        return tuple(zip(self.keys, self.layout.unpack(data), strict=True))


@dataclass(frozen=True)
class Pdo:
    """A valid PDO.

    Attributes:
        number: 1 to 4.
        cob_id: its identifier.
        kind: transmission type, 0 to 255.
        event_ms: event timer of a TPDO [ms], 0 for none.
        mapping: what it carries.
    """

    number: int
    cob_id: int
    kind: int
    event_ms: int
    mapping: Mapping


def valid_pdos(objects: ObjectDictionary, parameter: int, mapping: int, longest: int) -> list[Pdo]:
    """The PDOs whose COB-ID is valid and that carry something, by their number.

    Args:
        objects: the drive's values.
        parameter: 0x1400 for RPDOs, 0x1800 for TPDOs.
        mapping: 0x1600 for RPDOs, 0x1A00 for TPDOs.
        longest: bytes of a frame on this bus.
    """
    pdos = []
    for k in range(PDO_COUNT):
        cob_id = objects.values[parameter + k, 1]
        count = objects.values[mapping + k, 0]
        if cob_id & _INVALID or count == 0:
            continue
        event_ms = objects.values[parameter + k, 5] if parameter == TPDO_PARAMETER else 0
        content = compile_mapping(objects, mapping + k, count, longest)
        kind = objects.values[parameter + k, 2]
        pdos.append(Pdo(k + 1, cob_id & _ID_BITS, kind, event_ms, content))
    return pdos


def compile_mapping(objects: ObjectDictionary, index: int, count: int, longest: int) -> Mapping:
    """The first `count` entries of a mapping object.

    Raises:
        SdoAbort: an entry that cannot be mapped, or more bytes than a frame has.
    """
    receiving = index < TPDO_PARAMETER
    keys: list[Key] = []
    layout = "<"
    for position in range(1, count + 1):
        entry = objects.values[index, position]
        key, bits = (entry >> 16, entry >> 8 & 0xFF), entry & 0xFF
        if receiving and key[0] in objects.description.dummies and key[1] == 0:
            if bits != 8 * objects.description.dummies[key[0]]:
                raise SdoAbort(Abort.NOT_MAPPABLE)
            layout += "x" * (bits // 8)
        else:
            layout += _letter(objects, key, bits, receiving)
            keys.append(key)
    if struct.calcsize(layout) > longest:
        raise SdoAbort(Abort.PDO_TOO_LONG)
    getters = tuple(objects.getter(key) for key in keys)
    return Mapping(tuple(keys), getters, struct.Struct(layout))


def _letter(objects: ObjectDictionary, key: Key, bits: int, receiving: bool) -> str:
    entry = objects.description.entries.get(key)
    if (
        entry is None
        or not entry.mappable
        or bits != 8 * entry.size
        or not (entry.writable if receiving else entry.readable)
    ):
        raise SdoAbort(Abort.NOT_MAPPABLE)
    return entry.format


def is_pdo_object(index: int) -> bool:
    """Whether an object is a PDO's parameter or mapping."""
    return RPDO_PARAMETER <= index < TPDO_MAPPING + PDO_COUNT


def check_write(objects: ObjectDictionary, key: Key, value: int, longest: int) -> None:
    """Refuse a write to a PDO's parameters or mapping that breaks the order of re-mapping.

    The order: COB-ID invalid, number of entries 0, entries, number of entries, type, COB-ID valid.

    Raises:
        SdoAbort: with the code of the rule that was broken.
    """
    index, subindex = key
    if index & 0x0200:
        _check_mapping_write(objects, key, value, longest)
    elif subindex == 1:
        _check_cob_id(objects.values[index, 1], value)
    elif subindex == 2 and LAST_SYNCHRONOUS < value < 254:
        raise SdoAbort(Abort.VALUE_RANGE)
    elif subindex == 3 and not objects.values[index, 1] & _INVALID:
        raise SdoAbort(Abort.DEVICE_STATE)


def _check_mapping_write(objects: ObjectDictionary, key: Key, value: int, longest: int) -> None:
    index, subindex = key
    if not objects.values[index - 0x200, 1] & _INVALID:
        raise SdoAbort(Abort.DEVICE_STATE)
    if subindex == 0:
        compile_mapping(objects, index, value, longest)
    elif objects.values[index, 0] != 0:
        raise SdoAbort(Abort.UNSUPPORTED_ACCESS)


def _check_cob_id(present: int, wanted: int) -> None:
    both_valid = not (present & _INVALID or wanted & _INVALID)
    if both_valid and (present ^ wanted) & _ID_BITS:
        raise SdoAbort(Abort.VALUE_RANGE)
    identifier = wanted & _ID_BITS
    reserved = any(low <= identifier <= high for low, high in _RESERVED)
    if not wanted & _INVALID and (identifier > 0x7FF or reserved):
        raise SdoAbort(Abort.VALUE_RANGE)
