"""The Parquet files of a fleet: their schemas, and rows made of what was found."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ident.fleet.arm_type import ArmType
from ident.fleet.hierarchy import DAILY, TypeStatistics
from ident.fleet.reduce import VERSION
from ident.fleet.series import ArmResult, Entry, Series
from ident.signals.arrays import Array

_TIME = pa.timestamp("us", tz="UTC")

LOGS = pa.schema(
    [
        pa.field("arm", pa.string()),
        pa.field("time", _TIME),
        pa.field("log", pa.string()),
        pa.field("verdict", pa.string()),
        pa.field("remarks", pa.list_(pa.string())),
        pa.field("temperature", pa.float64()),
        pa.field("hash", pa.string()),
        pa.field("type", pa.string()),
        pa.field("firmware", pa.string()),
        pa.field("tool", pa.string()),
        pa.field("duration_s", pa.float64()),
        pa.field("log_odds", pa.float64()),
        pa.field("version", pa.int32()),
    ]
)
"""Of `logs.parquet`: a row for each log."""

PARAMETERS = pa.schema(
    [
        pa.field("arm", pa.string()),
        pa.field("time", _TIME),
        pa.field("log", pa.string()),
        pa.field("parameter", pa.string()),
        pa.field("value", pa.float64()),
        pa.field("sd", pa.float64()),
        pa.field("unit", pa.string()),
        pa.field("level", pa.float64()),
        pa.field("level_sd", pa.float64()),
        pa.field("temperature", pa.float64()),
        pa.field("verdict", pa.string()),
        pa.field("hash", pa.string()),
        pa.field("version", pa.int32()),
    ]
)
"""Of `parameters.parquet`: a row for each log and parameter."""


def log_row(entry: Entry, log_odds: float | None) -> dict[str, Any]:
    """A log's row."""
    reduced = entry.stored.reduced
    return {
        "arm": entry.arm,
        "time": entry.time_ns // 1000 if reduced.first_ns is not None else None,
        "log": entry.stored.source.address,
        "verdict": reduced.verdict,
        "remarks": [f"{code}: {sentence}" for code, sentence in reduced.remarks],
        "temperature": entry.temperature_c,
        "hash": reduced.hash,
        "type": reduced.type,
        "firmware": entry.firmware,
        "tool": entry.tool,
        "duration_s": reduced.duration_s,
        "log_odds": log_odds,
        "version": VERSION,
    }


def write_logs(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write `logs.parquet`."""
    table = pa.Table.from_pylist([dict(r) for r in rows], schema=LOGS)
    pq.write_table(table, path, compression="zstd")


def parameter_table(series: Series, result: ArmResult) -> pa.Table:
    """An arm's rows of `parameters.parquet`."""
    entries, names = series.entries, series.kind.names
    T, p = result.values.shape

    def by_log(values: list[Any]) -> list[Any]:
        return [v for v in values for _ in range(p)]

    columns = {
        "arm": [series.arm] * (T * p),
        "time": by_log([e.time_ns // 1000 for e in entries]),
        "log": by_log([e.stored.source.address for e in entries]),
        "parameter": [n.text for n in names] * T,
        "value": result.values.ravel(),
        "sd": result.sds.ravel(),
        "unit": [n.unit for n in names] * T,
        "level": result.levels.ravel(),
        "level_sd": result.level_sds.ravel(),
        "temperature": by_log([e.temperature_c for e in entries]),
        "verdict": by_log([e.stored.reduced.verdict for e in entries]),
        "hash": by_log([e.stored.reduced.hash for e in entries]),
        "version": np.full(T * p, VERSION),
    }
    arrays = [pa.array(columns[f.name], type=f.type) for f in PARAMETERS]
    return pa.Table.from_arrays(arrays, schema=PARAMETERS)


def type_content(kind: ArmType, known: TypeStatistics) -> dict[str, Any]:
    """What is known of a type, as `fleet.json` has it."""
    rows: list[dict[str, Any]] = [
        {"name": n.text, "unit": n.unit, "mean": m, "spread": s}
        for n, m, s in zip(kind.names, known.mean.tolist(), np.sqrt(known.D).tolist(), strict=True)
    ]
    for place, q in zip(kind.of_kinds(*DAILY), known.Q.tolist(), strict=True):
        rows[place]["daily"] = q**0.5
    slopes = zip(kind.warm, known.slopes.tolist(), known.slopes_sd.tolist(), strict=True)
    for places, slope, sd in slopes:
        for place in places:
            rows[place] |= {"per_kelvin": slope, "per_kelvin_sd": sd}
    return {
        "model": kind.arm,
        "joints": list(kind.joints),
        "learned_from": {"arms": known.arms, "logs": known.logs},
        "reference_temperature_c": known.reference_c,
        "noise_nm": known.noise.tolist(),
        "parameters": rows,
    }


def shown_content(series: Series, smallest: Sequence[Array]) -> list[dict[str, Any]]:
    """The smallest changes that the latest logs of a type's median arm would tell.

    Args:
        series: any arm of the type.
        smallest: of each arm, in multiples of the usual size, see `ArmResult`.
    """
    known = [s for s in smallest if not np.isnan(s).any()]
    if not known:
        return []
    times, most = np.median(known, axis=0).tolist(), series.settings.unseen_times
    return [
        {
            "name": c.name,
            "joints": list(c.joints),
            "parameter": c.reported_name or c.parameters[0],
            "size": size * c.reported_usual if size < most else None,
            "unit": c.units[0],
        }
        for c, size in zip(series.candidates(), times, strict=True)
    ]
