"""The reduced logs of a fleet, for what is done with them by arithmetic."""

import json
from collections import defaultdict
from collections.abc import Collection
from pathlib import Path

from ident.fleet.metadata import Rules
from ident.fleet.series import Entry
from ident.fleet.settings import DEFAULT
from ident.fleet.sources import found_logs
from ident.fleet.store import Store, key_of
from ident.recordings.loading import Reading, fingerprint
from wamctl.arm.config import find_file


def entries_of(
    logs: Path, out: Path, robot: str, left_out: Collection[str] = ()
) -> tuple[Store, dict[str, list[Entry]]]:
    """Reduced logs by arm, in order of time.

    Args:
        logs: what `ident fleet` was given.
        out: what it wrote.
        robot: the arms' description.
        left_out: arms that are not wanted.
    """
    path = find_file(Path(robot)).resolve()
    store = Store(out / "reduced", key_of(fingerprint(path), Reading(), DEFAULT.reduction))
    arms: dict[str, list[Entry]] = defaultdict(list)
    for source in found_logs([str(logs)]):
        stored = store.known(source)
        if stored is None or not stored.reduced.rows or source.folder in left_out:
            continue
        said = Rules().said(source, stored.reduced.metadata, stored.reduced.first_ns or 0)
        arms[said.arm].append(Entry(**vars(said), stored=stored))
    return store, {a: sorted(e, key=lambda e: e.time_ns) for a, e in arms.items()}


def unchanged(fleet: Path, out: Path) -> tuple[Store, dict[str, list[Entry]]]:
    """Of the arms of `fleet_maker.py` that it has not changed."""
    told = {p["arm"] for p in json.loads((fleet / "planted.json").read_text("utf-8"))}
    return entries_of(fleet / "logs", out, "wam7.yaml", told)
