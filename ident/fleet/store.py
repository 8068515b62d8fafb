"""The reduced logs on disk, a Parquet file each: what was reduced once is not read again."""

import hashlib
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ident.checks.remark import Grade
from ident.fleet.arm_type import ArmType
from ident.fleet.reduce import VERSION, Reduced
from ident.fleet.sources import Source

SCHEMA = pa.schema(
    [
        pa.field("address", pa.string()),
        pa.field("size", pa.int64()),
        pa.field("modified", pa.string()),
        pa.field("key", pa.string()),
        pa.field("hash", pa.string()),
        pa.field("metadata", pa.map_(pa.string(), pa.string())),
        pa.field("first_ns", pa.int64()),
        pa.field("duration_s", pa.float64()),
        pa.field("arm", pa.string()),
        pa.field("type", pa.string()),
        pa.field("verdict", pa.string()),
        pa.field("remarks", pa.list_(pa.list_(pa.string()))),
        pa.field("rows", pa.list_(pa.int64())),
        pa.field("rows_per_value", pa.float64()),
        pa.field("triangles", pa.binary()),
    ]
)
"""Of a reduced log's file; `triangles` are described in docs/fleet.md."""

_WITHOUT_TRIANGLES = [name for name in SCHEMA.names if name != "triangles"]


@dataclass(frozen=True)
class Stored:
    """A reduced log on disk.

    Attributes:
        source: where the log lay when it was read.
        reduced: all but its triangles.
        file: where these are.
    """

    source: Source
    reduced: Reduced
    file: Path

    def refused(self, code: str, sentence: str) -> "Stored":
        """The same log, not to be used, and why."""
        remarks = ((code, sentence), *self.reduced.remarks)
        reduced = replace(self.reduced, verdict=Grade.REFUSED.word, remarks=remarks)
        return replace(self, reduced=reduced)

    def triangles(self) -> bytes | None:
        """Its triangles, read from disk."""
        return pq.read_table(self.file, columns=["triangles"]).column(0)[0].as_py()


@dataclass(frozen=True)
class Store:
    """A folder of reduced logs.

    Attributes:
        folder: where they are.
        key: of all that a reduction follows from beside the log: other ones are made anew.
    """

    folder: Path
    key: str

    def file(self, address: str) -> Path:
        """Where the log of an address is kept."""
        name = hashlib.sha256(address.encode()).hexdigest()[:32]
        return self.folder / "logs" / name[:2] / f"{name}.parquet"

    def known(self, source: Source) -> Stored | None:
        """What is kept of a log; None where there is nothing, or of other settings."""
        path = self.file(source.address)
        try:
            row = pq.read_table(path, columns=_WITHOUT_TRIANGLES).to_pylist()[0]
        except (OSError, pa.ArrowException, IndexError):
            return None
        if row["key"] != self.key or row["address"] != source.address:
            return None
        where = Source(row["address"], row["size"], row["modified"])
        named = {k: row[k] for k in ("hash", "first_ns", "duration_s", "arm", "type", "verdict")}
        reduced = Reduced(
            **named,
            rows_per_value=row["rows_per_value"],
            metadata=dict(row["metadata"] or []),
            remarks=tuple((code, sentence) for code, sentence in row["remarks"]),
            rows=tuple(row["rows"] or ()),
        )
        return Stored(where, reduced, path)

    def keep(self, source: Source, reduced: Reduced) -> Stored:
        """Write a log's reduction: whole, or not at all."""
        if reduced.facts:
            self._write(self._type_file(reduced.type), reduced.facts.encode())
        path = self.file(source.address)
        row: dict[str, Any] = asdict(reduced) | asdict(source) | {"key": self.key}
        row |= {"remarks": [list(r) for r in reduced.remarks]}
        del row["facts"]
        table = pa.Table.from_pylist([row], schema=SCHEMA)
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink, compression="zstd")
        self._write(path, sink.getvalue().to_pybytes())
        return Stored(source, replace(reduced, triangles=None, facts=""), path)

    def arm_type(self, name: str) -> ArmType:
        """What the columns of a type stand for."""
        return ArmType.read(self._type_file(name).read_text(encoding="utf-8"))

    def _type_file(self, name: str) -> Path:
        return self.folder / "types" / f"{name}.json"

    def _write(self, path: Path, content: bytes) -> None:
        if path.exists() and path.read_bytes() == content:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_bytes(content)
        os.replace(part, path)


def key_of(*parts: object) -> str:
    """The key of what reductions follow from."""
    return hashlib.sha256("\n".join(map(repr, (VERSION, *parts))).encode()).hexdigest()
