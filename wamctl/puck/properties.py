"""Which number a property has in a Puck of a given firmware version."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from wamctl.puck.errors import PropertyError
from wamctl.puck.property_tables import COMMON, MOTOR, SAFETY

OLDEST_VERSION = 32
PARTED_FROM = 61  # up to version 60 the safety Puck shares the motor Pucks' list
SAFE_ON_EVERY_VERSION = {
    "VERS": 0,
    "ROLE": 1,
    "SN": 2,
    "ID": 3,
    "ERROR": 4,
    "STAT": 5,
    "ADDR": 6,
    "VALUE": 7,
}
"""What may be asked before VERS is known."""


@dataclass(frozen=True)
class Span:
    """A property's id in the firmware versions `first` to `last`; `last` None: to this day."""

    first: int
    last: int | None
    id: int

    def __contains__(self, version: int) -> bool:
        return self.first <= version and (self.last is None or version <= self.last)

    def __str__(self) -> str:
        if self.last is None:
            return f"{self.first} and later"
        return f"{self.first} to {self.last}" if self.last > self.first else f"{self.first}"


Table = Mapping[str, tuple[Span, ...]]


def parse(text: str) -> dict[str, tuple[Span, ...]]:
    """The table of a text in the form that `property_tables` describes."""
    return {
        name: tuple(
            Span(int(first), int(last) if last else None if plus else int(first), int(number))
            for first, last, plus, number in re.findall(r"(\d+)(?:-(\d+))?(\+?):(\d+)", spans)
        )
        for name, spans in (line.split(maxsplit=1) for line in text.strip().splitlines())
    }


@dataclass(frozen=True)
class Properties:
    """The properties that one kind of Puck has in one firmware version.

    Attributes:
        kind: the kind, for messages.
        version: VERS of the firmware.
        table: all versions' ids of this kind.
    """

    kind: str
    version: int
    table: Table

    def __getitem__(self, name: str) -> int:
        """The id of a property.

        Raises:
            PropertyError: the firmware has no such property.
        """
        spans = self.table.get(name, ())
        for span in spans:
            if self.version in span:
                return span.id
        where = (
            f"versions {', '.join(map(str, spans))} have it" if spans else "no version is known to"
        )
        raise PropertyError(
            f"Firmware {self.version} of a {self.kind} has no property {name}: {where}."
        )

    def ids(self) -> dict[str, int]:
        """Name and id of every property of this version."""
        return {n: s.id for n, spans in self.table.items() for s in spans if self.version in s}


def motor_properties(version: int) -> Properties:
    """Properties of a motor Puck.

    Raises:
        PropertyError: a version that was never released.
    """
    return Properties("motor Puck", _released(version), _tables()["motor"])


def safety_properties(version: int) -> Properties:
    """Properties of the safety Puck.

    Raises:
        PropertyError: a version that was never released.
    """
    own = "safety" if _released(version) >= PARTED_FROM else "motor"
    return Properties("safety Puck", version, _tables()[own])


def _released(version: int) -> int:
    if version < OLDEST_VERSION:
        raise PropertyError(
            f"The Puck says that its firmware is version {version}; the oldest that was released "
            f"is {OLDEST_VERSION}: check VERS with the Puck out of its monitor."
        )
    return version


@cache
def _tables() -> dict[str, Table]:
    common = parse(COMMON)
    return {"motor": common | parse(MOTOR), "safety": common | parse(SAFETY)}
