"""The object dictionary of a drive (CiA 301, chapter 7.4): its EDS, and the values it holds."""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from pathlib import Path

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from wamctl.arm.errors import ConfigurationError

Key = tuple[int, int]
"""Index and sub-index."""

Getter = Callable[[], int]

_FORMATS = {
    datatypes.BOOLEAN: "B",
    datatypes.INTEGER8: "b",
    datatypes.INTEGER16: "h",
    datatypes.INTEGER32: "i",
    datatypes.UNSIGNED8: "B",
    datatypes.UNSIGNED16: "H",
    datatypes.UNSIGNED32: "I",
}


class Abort(IntEnum):
    """SDO abort codes (CiA 301, table 22), as far as this drive gives them."""

    TOGGLE_BIT = 0x05030000
    COMMAND = 0x05040001
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_TOO_LONG = 0x06040042
    LENGTH = 0x06070010
    NO_SUBINDEX = 0x06090011
    VALUE_RANGE = 0x06090030
    DEVICE_STATE = 0x08000022


class SdoAbort(Exception):  # noqa: N818 - the standard's word
    """A read or write that the drive refuses."""

    def __init__(self, code: Abort) -> None:
        self.code = code
        super().__init__(code)


@dataclass(frozen=True)
class Entry:
    """One object, or one sub-index of it.

    Attributes:
        format: `struct` letter of a number; empty for a string.
        readable, writable: by SDO.
        mappable: into a PDO; into an RPDO only when also writable.
        low, high: bounds of its value; None where the type alone bounds it.
        default: value after a reset; a string is never changed.
        counts_from_node_id: whether the node id is to be added to the default.
    """

    format: str
    readable: bool
    writable: bool
    mappable: bool
    low: int | None
    high: int | None
    default: int | str
    counts_from_node_id: bool

    @property
    def size(self) -> int:
        """Bytes of a number; 0 for a string."""
        return struct.calcsize(f"<{self.format}") if self.format else 0


@dataclass(frozen=True)
class Description:
    """Content of an EDS file.

    Attributes:
        entries: all entries by index and sub-index.
        dummies: bytes of each data type that an RPDO may map as a dummy (CiA 301, 7.4.7.1).
    """

    entries: dict[Key, Entry]
    dummies: dict[int, int]

    def of_node(self, node_id: int) -> "Description":
        """Defaults for one node id, since some of them depend on it."""
        own = {
            key: replace(e, default=e.default + node_id)
            for key, e in self.entries.items()
            if e.counts_from_node_id and isinstance(e.default, int)
        }
        return Description(self.entries | own, self.dummies)


def read_description(eds: Path) -> Description:
    """The content of an EDS file, with node id 0.

    Raises:
        ConfigurationError: the file is missing or no EDS.
    """
    try:
        dictionary = canopen.import_od(str(eds), 0)
    except (OSError, ValueError, KeyError, canopen.ObjectDictionaryError) as error:
        raise ConfigurationError(eds, [f"not a readable EDS file ({error})"]) from error
    if not dictionary.indices:
        raise ConfigurationError(eds, ["not a readable EDS file (it describes no object)"])
    entries = {(v.index, v.subindex): _entry(v) for v in _variables(dictionary)}
    dummies = {i: e.size for (i, _), e in entries.items() if i < 0x20}
    return Description({k: e for k, e in entries.items() if k[0] >= 0x1000}, dummies)


def _variables(dictionary: canopen.ObjectDictionary) -> Iterator[ODVariable]:
    for entry in dictionary.indices.values():
        if isinstance(entry, ODVariable):
            yield entry
        else:
            yield from entry.subindices.values()


def _entry(variable: ODVariable) -> Entry:
    letter = _FORMATS.get(variable.data_type or 0, "")
    fallback: int | str = 0 if letter else ""
    return Entry(
        letter,
        variable.readable,
        variable.writable,
        variable.pdo_mappable,
        variable.min,
        variable.max,
        fallback if variable.default is None else variable.default,
        variable.relative,
    )


class ObjectDictionary:
    """The values of a drive's objects.

    Attributes:
        description: what the EDS says.
        values: stored value of every number; the drive itself reads and writes it directly.
    """

    def __init__(
        self, description: Description, fixed: dict[Key, int], live: dict[Key, Getter]
    ) -> None:
        self.description = description
        self._live = live
        self._fixed = fixed
        self.values: dict[Key, int] = {}
        self.reset(0x1000, 0xFFFF)

    def reset(self, first: int, last: int) -> None:
        """Default values for all entries from index `first` to index `last`."""
        entries = self.description.entries.items()
        chosen = {k: e.default for k, e in entries if first <= k[0] <= last}
        self.values |= {k: v for k, v in chosen.items() if isinstance(v, int)}
        self.values |= {k: v for k, v in self._fixed.items() if k in chosen}

    def fix(self, key: Key, value: int) -> None:
        """Give an entry a value that no reset changes."""
        self._fixed[key] = self.values[key] = value

    def getter(self, key: Key) -> Getter:
        """Getter of an object's present value, stored or computed by the drive."""
        return self._live.get(key) or partial(self.values.__getitem__, key)

    def entry(self, key: Key) -> Entry:
        """The description of an entry.

        Raises:
            SdoAbort: there is none.
        """
        entries = self.description.entries
        if key in entries:
            return entries[key]
        known = any(index == key[0] for index, _ in entries)
        raise SdoAbort(Abort.NO_SUBINDEX if known else Abort.NO_OBJECT)

    def read(self, key: Key) -> bytes:
        """The value as an SDO carries it.

        Raises:
            SdoAbort: no such entry, or not readable.
        """
        entry = self.entry(key)
        if not entry.readable:
            raise SdoAbort(Abort.WRITE_ONLY)
        if not entry.format:
            return str(entry.default).encode()
        return struct.pack(f"<{entry.format}", self.getter(key)())

    def decode(self, key: Key, data: bytes) -> int:
        """The number that a write by SDO means; it is checked, and not yet stored.

        Raises:
            SdoAbort: no such entry, not writable, of another length or out of its bounds.
        """
        entry = self.entry(key)
        if not entry.writable:
            raise SdoAbort(Abort.READ_ONLY)
        if len(data) != entry.size:
            raise SdoAbort(Abort.LENGTH)
        (value,) = struct.unpack(f"<{entry.format}", data)
        low, high = entry.low, entry.high
        if (low is not None and value < low) or (high is not None and value > high):
            raise SdoAbort(Abort.VALUE_RANGE)
        return value
