"""All logs of a fleet reduced: those that are known already are not read again."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ident.checks.remark import Grade
from ident.fleet.engine import LostError, Make, done
from ident.fleet.reduce import Reduced, reduced
from ident.fleet.settings import FleetSettings
from ident.fleet.sources import Source, local_copy
from ident.fleet.store import Store, Stored
from ident.recordings.loading import Reading, fingerprint
from wamctl.arm.errors import DataError


@dataclass(frozen=True)
class Task:
    """One log to be reduced, wherever a worker is.

    Attributes:
        source: the log.
        robot: file that describes the arm; None: what travels inside the log.
        reading: topics and torque to read.
        settings: of the fleet.
        known: digest of what is kept of it already; empty: nothing.
    """

    source: Source
    robot: Path | None
    reading: Reading
    settings: FleetSettings
    known: str = ""


def work(task: Task) -> Reduced | None:
    """Reduce the log of a task; None where its content is what is kept already."""
    try:
        with local_copy(task.source.address) as path:
            if task.known and fingerprint(path) == task.known:
                return None
            return reduced(path, task.robot, task.reading, task.settings)
    except (DataError, OSError) as error:
        return _unusable("unreachable", str(error))


def _unusable(code: str, sentence: str) -> Reduced:
    return Reduced("", {}, None, 0.0, "", "", Grade.REFUSED.word, ((code, sentence),))


def reduce_all(
    store: Store,
    make: Make,
    waiting: int,
    sources: Sequence[Source],
    task: Task,
) -> Iterator[Stored]:
    """The logs, as they get ready; they are kept as they come.

    Args:
        store: where they are kept.
        make: makes executors.
        waiting: most logs that are given out at a time.
        sources: the logs.
        task: as of any of them.
    """
    tasks = []
    for source in sources:
        stored = store.known(source)
        usable = stored is not None and stored.reduced.hash != ""
        if stored is not None and usable and stored.source == source:
            yield stored
        else:
            known = stored.reduced.hash if stored is not None else ""
            tasks.append(replace(task, source=source, known=known))
    for one, found in done(make, work, tasks, waiting):
        source = one.source
        if isinstance(found, LostError):
            ended = f"{source.address}: the process that read it ended each time; read it alone."
            found = _unusable("lost", ended)
        if found is None:
            stored = store.known(source)
            if stored is not None:
                yield replace(stored, source=source)
        else:
            yield store.keep(source, found)
