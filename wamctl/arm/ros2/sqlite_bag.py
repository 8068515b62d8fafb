"""A bag of ROS 2's earlier storage, SQLite."""

import sqlite3
from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.part import BATCH, Batch, Part, Topic

MAGIC = b"SQLite format 3\0"
_TABLES = ("topics", "messages")


def sqlite_parts(file: Path, topics: Collection[str]) -> Iterator[Part]:
    """What is in a `.db3` file, in the order of time.

    Raises:
        DataError: not a bag, or damaged inside.
    """
    most = file.stat().st_size
    try:
        with closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)) as database:
            _only_tables(database, file)
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, most)
            rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
            names = {}
            for number, name, kind, encoding in rows:
                names[number] = name
                yield Topic(str(name), str(kind), str(encoding))
            marks = ", ".join(str(number) for number, name in names.items() if name in topics)
            messages = database.execute(
                "SELECT topic_id, timestamp, data FROM messages"
                f" WHERE topic_id IN ({marks}) ORDER BY timestamp, id"
            )
            while rows := messages.fetchmany(BATCH):
                batch = Batch(defaultdict(list), defaultdict(list))
                for number, log_ns, data in rows:
                    if not (isinstance(data, bytes) and isinstance(log_ns, int)):
                        raise DataError(f"{file} is damaged: a message is no bytes with a time.")
                    most -= len(data)
                    batch.log_ns[names[number]].append(log_ns)
                    batch.messages[names[number]].append(data)
                if most < 0:
                    raise DataError(f"{file} is damaged: its messages are longer than the file.")
                yield batch
    except (sqlite3.Error, OverflowError, UnicodeDecodeError) as error:
        raise DataError(f"{file} is damaged, or not a ROS 2 bag ({error}).") from error


def _only_tables(database: sqlite3.Connection, file: Path) -> None:
    """Refuses views and computed columns, which could be of any size and take any time.

    Raises:
        DataError: there are some.
    """
    kinds = "SELECT count(*) FROM sqlite_master WHERE type IN ('view', 'trigger')"
    computed = "SELECT count(*) FROM pragma_table_xinfo(?) WHERE hidden > 0"
    found = [database.execute(kinds), *(database.execute(computed, [t]) for t in _TABLES)]
    if any(count for ((count,),) in found):
        raise DataError(f"{file} is no ROS 2 bag: its database holds views or computed columns.")
