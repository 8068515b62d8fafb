"""Which arm a log is of, when, and under what: from a table, from its address, from the log."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from ident.fleet.sources import Source
from wamctl.arm.errors import ConfigurationError

FIELDS = ("arm", "time", "firmware", "tool", "temperature")
"""What a pattern or a table may say of a log."""

_FIELD = re.compile(r"\{(\w+)\}")
_TEMPERATURE = ("temperature_c", "temperature")


@dataclass(frozen=True)
class Said:
    """What is known of a log beside its samples.

    Attributes:
        arm: which arm it is of.
        time_ns: when it began, since 1970 in UTC [ns].
        firmware, tool: words, empty where nobody says so.
        temperature_c: of the drives or the room [deg C]; None where nobody says so.
    """

    arm: str
    time_ns: int
    firmware: str
    tool: str
    temperature_c: float | None


@dataclass(frozen=True)
class Rules:
    """Where it is known from.

    Attributes:
        pattern: end of the addresses with fields, such as `{arm}/{time}_{temperature}.mcap`.
        rows: of a table, by the end of the address.
    """

    pattern: re.Pattern[str] | None = None
    rows: Mapping[str, dict[str, str]] = field(default_factory=dict)

    def said(self, source: Source, metadata: Mapping[str, str], first_ns: int) -> Said:
        """What the table, else the address, else the log itself says; the folder names the arm.

        Raises:
            ConfigurationError: a time or temperature that is none.
        """
        words = {name: metadata[name] for name in ("firmware", "tool") if name in metadata}
        warm = [metadata[name] for name in _TEMPERATURE if name in metadata]
        words |= {"temperature": warm[0]} if warm else {}
        match = self.pattern.search(source.address) if self.pattern else None
        words |= {k: v for k, v in (match.groupdict() if match else {}).items() if v}
        words |= {k: v for k, v in self._row(source.address).items() if v}
        return Said(
            arm=words.get("arm", source.folder),
            time_ns=_time_ns(words["time"], source) if "time" in words else first_ns,
            firmware=words.get("firmware", ""),
            tool=words.get("tool", ""),
            temperature_c=_degrees(words.get("temperature"), source),
        )

    def _row(self, address: str) -> dict[str, str]:
        parts = address.split("/")
        for k in range(len(parts)):
            row = self.rows.get("/".join(parts[k:]))
            if row is not None:
                return row
        return {}


def rules(pattern: str | None, table: Path | None) -> Rules:
    """The rules of a command line.

    Args:
        pattern: see `Rules`; `*` stands for anything within a folder.
        table: CSV with a column `log`, the log's address or the end of it, and any of `FIELDS`.

    Raises:
        ConfigurationError: unknown fields, or a table that cannot be read.
    """
    return Rules(_compiled(pattern) if pattern else None, _rows(table) if table else {})


def _compiled(pattern: str) -> re.Pattern[str]:
    names = _FIELD.findall(pattern)
    unknown = [n for n in names if n not in FIELDS]
    if unknown or not names:
        wrong = f"unknown field {unknown[0]!r}" if unknown else "no field"
        raise ConfigurationError("--pattern", [f"{wrong}; fields are {_listed()}"])
    text = re.escape(pattern).replace(r"\*", "[^/]*")
    text = re.sub(r"\\\{(\w+)\\\}", r"(?P<\1>[^/]+?)", text)
    return re.compile(f"(?:^|/){text}$")


def _listed() -> str:
    return ", ".join(f"{{{name}}}" for name in FIELDS)


def _rows(table: Path) -> dict[str, dict[str, str]]:
    try:
        with table.open(newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigurationError(table, [f"cannot be read ({error})"]) from error
    if not rows or "log" not in rows[0]:
        heads = ", ".join(("log", *FIELDS))
        raise ConfigurationError(table, [f"has no rows under a head with a column log; of {heads}"])
    return {row["log"]: {k: v for k, v in row.items() if k in FIELDS} for row in rows}


def _time_ns(text: str, source: Source) -> int:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return _seconds_ns(text, source)
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return round(moment.timestamp() * 1e6) * 1000


def _seconds_ns(text: str, source: Source) -> int:
    try:
        return round(float(text) * 1e9)
    except ValueError as error:
        raise ConfigurationError(
            source.address, [f"{text!r} is no time: give ISO 8601 or seconds since 1970"]
        ) from error


def _degrees(text: str | None, source: Source) -> float | None:
    if text is None:
        return None
    try:
        return float(text)
    except ValueError as error:
        raise ConfigurationError(
            source.address, [f"{text!r} is no temperature in degrees Celsius"]
        ) from error


def iso(time_ns: int) -> str:
    """A moment as ISO 8601 in UTC, to the second."""
    return datetime.fromtimestamp(time_ns // 10**9, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
