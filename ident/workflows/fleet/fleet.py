"""The work of `ident fleet`, from logs to files."""

import importlib.metadata
import shutil
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from ident.checks.remark import Grade
from ident.fleet.changes import Change
from ident.fleet.engine import LOCAL, THIS_MACHINE, Workers, engine
from ident.fleet.fleet import Judged, judge, results
from ident.fleet.metadata import Rules, iso
from ident.fleet.reducing import Task, reduce_all
from ident.fleet.series import ArmResult, Entry, Series
from ident.fleet.settings import DEFAULT, FleetSettings
from ident.fleet.sources import found_logs
from ident.fleet.store import Store, Stored, key_of
from ident.recordings.loading import Reading, fingerprint
from ident.regression.progress import Tell, silent
from ident.report.fleet.arm_page import arm_page
from ident.report.fleet.index_page import index_page
from ident.report.page import render
from ident.signals.arrays import Array
from ident.workflows.fleet.changed_gap import Asking
from ident.workflows.run_json import as_json
from ident.workflows.work import whole_folder
from wamctl.arm.config import find_file
from wamctl.arm.errors import ConfigurationError

PAGES = "arms"
FILES = ("fleet.json", "logs.parquet", "parameters.parquet", "changes.json", "fleet.html")


def fleet_logs(
    addresses: Sequence[str],
    out: Path,
    robot: Path | None,
    reading: Reading,
    rules: Rules,
    workers: Workers = THIS_MACHINE,
    settings: FleetSettings = DEFAULT,
    tell: Tell = silent,
) -> str:
    """Reduce what is new, test all arms, write; gives the content of `fleet.json`.

    Args:
        addresses: folders, globs, or URLs.
        out: folder for the results, and for the reductions that are kept.
        robot: file that describes the arms; None: what travels inside the logs.
        reading: topics and torque to read.
        rules: how a log's arm, time, firmware, tool and temperature are known.
        workers: who reads the logs and judges the arms.
        settings: of the statistics.
        tell: hears what is being done.

    Raises:
        UserError: what cannot be done at all; a single log never stops the others.
    """
    if find_spec("pyarrow") is None:
        raise ConfigurationError(
            "ident fleet", ["needs pyarrow, which is not installed: pip install 'wam-ident[fleet]'"]
        )
    tell("looking for logs")
    sources = found_logs(addresses)
    robot = None if robot is None else find_file(robot).resolve()
    key = key_of(robot and fingerprint(robot), reading, settings.reduction)
    store = Store(out / "reduced", key)
    make, waiting = engine(workers.scheduler, workers.count)
    stored: list[Stored] = []
    task = Task(sources[0], robot, reading, settings)
    for one in reduce_all(store, make, waiting, sources, task):
        stored.append(one)
        tell(f"reducing {len(sources)} logs", len(stored) / len(sources))
    entries = [_entry(one, rules) for one in stored]
    entries = _once_each(sorted(entries, key=_order))
    usable = [e for e in entries if e.stored.reduced.verdict != Grade.REFUSED.word]
    here = workers.scheduler if workers.scheduler == LOCAL else None
    make, waiting = engine(here, workers.count)
    judged = judge(store, usable, make, waiting, settings, tell)
    found = results(judged, make, waiting, tell)
    asking = Asking(out, robot, reading, settings, tell)
    return _write(entries, judged, found, asking)


def _order(entry: Entry) -> tuple[str, int, str]:
    return entry.arm, entry.time_ns, entry.stored.source.address


def _entry(stored: Stored, rules: Rules) -> Entry:
    """A log with what is known of it; what is said wrongly of it becomes its sentence."""
    reduced = stored.reduced
    try:
        said = rules.said(stored.source, reduced.metadata, reduced.first_ns or 0)
    except ConfigurationError as error:
        said = Rules().said(stored.source, {}, reduced.first_ns or 0)
        stored = stored.refused("metadata", str(error))
    return Entry(**asdict(said), stored=stored)


def _once_each(entries: Sequence[Entry]) -> list[Entry]:
    """The logs, with copies of the same bytes refused."""
    first: dict[str, str] = {}
    found = []
    for entry in entries:
        digest, address = entry.stored.reduced.hash, entry.stored.source.address
        if digest and digest in first:
            sentence = f"{address} has the same bytes as {first[digest]}; it counts once."
            entry = replace(entry, stored=entry.stored.refused("duplicate", sentence))
        first.setdefault(digest, address)
        found.append(entry)
    return found


def _write(
    entries: Sequence[Entry],
    judged: Judged,
    found: Iterator[tuple[Series, ArmResult]],
    asking: Asking,
) -> str:
    """Write all results; gives the content of `fleet.json`.

    Args:
        entries: all logs.
        judged: the fleet.
        found: what is said of each arm.
        asking: how changed arms are looked at, and where all is written.

    Raises:
        DataError: the folder cannot be written.
    """
    from pyarrow.parquet import ParquetWriter

    from ident.workflows.fleet.tables import (
        PARAMETERS,
        log_row,
        parameter_table,
        shown_content,
        type_content,
        write_logs,
    )

    out, settings = asking.out, asking.settings
    arms, changes, odds, searched = [], [], {}, 0
    pages: dict[str, str] = {}
    smallest: dict[str, list[Array]] = defaultdict(list)
    few = len(judged.series) <= settings.page_arms
    shutil.rmtree(out / PAGES, ignore_errors=True)
    with whole_folder(out, FILES) as folder:
        with ParquetWriter(
            folder / "parameters.parquet", PARAMETERS, compression="zstd"
        ) as parameters:
            for series, result in found:
                parameters.write_table(parameter_table(series, result))
                own = [change_content(series, c) for c in result.changes]
                if own and searched < settings.gap_arms:
                    own[0]["gap"] = asking.of(series, result)
                    searched += 1
                changes += own
                if few or own:
                    pages[series.arm] = _write_page(out, series, result, own)
                arms.append(arm_content(series, result))
                smallest[series.key[1]].append(result.smallest)
                for entry, value in zip(series.entries, result.log_odds.tolist(), strict=True):
                    odds[entry.stored.source.address] = value if np.isfinite(value) else None
        rows = [log_row(e, odds.get(e.stored.source.address)) for e in entries]
        write_logs(folder / "logs.parquet", rows)
        broken = [r for r in rows if r["verdict"] == Grade.REFUSED.word]
        content = {
            "arms": arms,
            "changes": changes,
            "logs": {"found": len(rows), "used": len(odds), "refused": len(broken)},
            "refused": [{"log": r["log"], "remarks": r["remarks"]} for r in broken],
            "types": {
                name: type_content(one.kind, one.known)
                | {"shown": shown_content(one, smallest[name])}
                for name, one in sorted({s.key[1]: s for s in judged.series}.items())
            },
            "least_log_odds": judged.least_odds if np.isfinite(judged.least_odds) else None,
            "settings": asdict(settings),
            "version": importlib.metadata.version("wam-ident"),
        }
        (folder / "changes.json").write_text(as_json(changes), encoding="utf-8")
        text = as_json(content)
        (folder / "fleet.json").write_text(text, encoding="utf-8")
        page = render(index_page(content, pages))
        (folder / "fleet.html").write_text(page, encoding="utf-8")
    return text


def _write_page(out: Path, series: Series, result: ArmResult, own: Sequence[Any]) -> str:
    """Write an arm's own page; gives its address beside `fleet.html`."""
    name = f"{quote(series.arm, safe='')}.html"
    path = out / PAGES / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(render(arm_page(series, result, own)), encoding="utf-8")
    return f"{PAGES}/{name}"


def change_content(series: Series, change: Change) -> dict[str, Any]:
    """A change as it stands in `changes.json`."""
    entries, c = series.entries, change.candidate
    return {
        "arm": series.arm,
        "since": iso(entries[change.onset].time_ns),
        "name": c.name,
        "joints": list(c.joints),
        "parameter": change.parameter,
        "size": change.size,
        "sd": change.sd,
        "unit": change.unit,
        "evidence": change.log_evidence,
        "told": iso(entries[change.told].time_ns),
        "first_log": entries[change.onset].stored.source.address,
        "onset_share": change.onset_share,
        "parameters": {
            name: {"value": value, "sd": sd, "unit": unit}
            for name, value, sd, unit in zip(
                c.parameters, change.sizes.tolist(), change.sds.tolist(), c.units, strict=True
            )
        },
        "rivals": [
            {"name": name, "joints": list(joints), "share": share}
            for name, joints, share in change.rivals
        ],
    }


def arm_content(series: Series, result: ArmResult) -> dict[str, Any]:
    """An arm as it stands in `fleet.json`: how it is now, beside its sisters."""
    known, kind = series.known, series.kind
    beside = result.levels[-1] - known.mean
    z = beside / np.sqrt(known.D + result.level_sds[-1] ** 2)
    far = int(np.argmax(np.abs(z)))
    last = result.log_odds[-1]
    return {
        "arm": series.arm,
        "type": series.entries[0].stored.reduced.type,
        "logs": len(series.entries),
        "first": iso(series.entries[0].time_ns),
        "last": iso(series.entries[-1].time_ns),
        "log_odds": float(last) if np.isfinite(last) else None,
        "changes": len(result.changes),
        "farthest": {"parameter": kind.names[far].text, "sds": float(z[far])},
    }
