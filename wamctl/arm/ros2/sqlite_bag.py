"""A bag of ROS 2's earlier storage, SQLite."""

import sqlite3
from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.part import BATCH, Batch, Part, Topic

MAGIC = b"SQLite format 3\0"


def sqlite_parts(file: Path, topics: Collection[str]) -> Iterator[Part]:
    """What is in a `.db3` file, in the order of time.

    Raises:
        DataError: not a bag, or damaged inside.
    """
    try:
        with closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)) as database:
            rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
            names = {}
            for number, name, kind, encoding in rows:
                names[number] = name
                yield Topic(name, kind, encoding)
            marks = ", ".join(str(number) for number, name in names.items() if name in topics)
            messages = database.execute(
                "SELECT topic_id, timestamp, data FROM messages"
                f" WHERE topic_id IN ({marks}) ORDER BY timestamp, id"
            )
            while rows := messages.fetchmany(BATCH):
                batch = Batch(defaultdict(list), defaultdict(list))
                for number, log_ns, data in rows:
                    batch.log_ns[names[number]].append(log_ns)
                    batch.messages[names[number]].append(data)
                yield batch
    except sqlite3.Error as error:
        raise DataError(f"{file} is damaged, or not a ROS 2 bag ({error}).") from error
