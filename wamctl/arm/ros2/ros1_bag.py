"""A bag of ROS 1, its messages in the encoding of ROS 2."""

import bz2
import struct
from collections import OrderedDict, defaultdict
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from rosbags.serde import SerdeError

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bounds import MOST_CHUNK, Allowance, lz4_unpacked
from wamctl.arm.ros2.part import BATCH_BYTES, Batch, Part, Topic

MAGIC = b"#ROSBAG V"
_KEPT_BYTES = 1 << 26  # of unpacked chunks


def ros1_parts(file: Path, topics: Collection[str]) -> Iterator[Part]:
    """What is in a `.bag` file, in the order of time.

    Raises:
        DataError: a version before 2.0, no index, or damaged inside.
    """
    # Here, since few recordings need it and it takes a quarter of a second to load.
    from rosbags.rosbag1 import Reader, ReaderError

    damage = (ReaderError, SerdeError, struct.error, AssertionError, LookupError, MemoryError)
    try:
        with Reader(file) as reader:
            _bounded(reader, file)
            for name, kind in dict.fromkeys((c.topic, c.msgtype) for c in reader.connections):
                yield Topic(name, kind, "cdr")
            yield from _batches(reader, file, topics)
    except (*damage, OSError, ValueError, EOFError, OverflowError, RuntimeError) as error:
        raise DataError(_damaged(file, str(error))) from error


def _batches(reader: Any, file: Path, topics: Collection[str]) -> Iterator[Batch]:
    """The wanted messages, those of types that ROS 2 has."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.LATEST)
    wanted = [c for c in reader.connections if c.topic in topics and c.msgtype in types.fielddefs]
    if not wanted:
        return
    allowance = Allowance.of(file)  # an index may name one message many times
    batch, size = Batch(defaultdict(list), defaultdict(list)), 0
    for connection, log_ns, message in reader.messages(wanted):
        allowance.take(len(message))
        batch.log_ns[connection.topic].append(log_ns)
        encoded = types.ros1_to_cdr(message, connection.msgtype)
        batch.messages[connection.topic].append(bytes(encoded))
        size += len(message)
        if size > BATCH_BYTES:
            yield batch
            batch, size = Batch(defaultdict(list), defaultdict(list)), 0
    yield batch


def _bounded(reader: Any, file: Path) -> None:
    """Let the reader unpack no more than a log may hold."""
    from rosbags.rosbag1.reader import decompressors

    allowance, kept = Allowance.of(file), OrderedDict[int, bytes]()
    bounded = {decompressors["bz2"]: _bz2_unpacked, decompressors["lz4"]: lz4_unpacked}
    for place, chunk in reader.chunks.items():
        if unpacked := bounded.get(chunk.decompressor):
            once = _Once(place, unpacked, allowance, kept)
            reader.chunks[place] = chunk._replace(decompressor=once)


class _Once:
    """Unpacks a chunk, and keeps the last few: those that overlap in time are met in turn.

    Args:
        place: of the chunk in its file.
        unpacked: what is packed, up to one byte more than a size.
        allowance: of the file, from which the chunk is taken once.
        kept: unpacked chunks of the file by their places, the last one met at the end.
    """

    def __init__(
        self,
        place: int,
        unpacked: Callable[[bytes, int], bytes],
        allowance: Allowance,
        kept: OrderedDict[int, bytes],
    ) -> None:
        self._place, self._unpacked, self._kept = place, unpacked, kept
        self._allowance: Allowance | None = allowance

    def __call__(self, data: bytes) -> bytes:
        found = self._kept.pop(self._place, None)
        if found is None:
            found = self._unpacked(data, MOST_CHUNK)
            if self._allowance:
                self._allowance.take(len(found))
                self._allowance = None
        self._kept[self._place] = found
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > _KEPT_BYTES:
            self._kept.popitem(last=False)
        return found


def _bz2_unpacked(data: bytes, size: int) -> bytes:
    """What bz2 packed, up to one byte more than a size."""
    return bz2.BZ2Decompressor().decompress(data, max_length=size + 1)


def _damaged(file: Path, why: str) -> str:
    if "not indexed" in why or "index looks damaged" in why:
        return f"{file} has no whole index: mend it with `rosbag reindex`, and give the result."
    return f"{file} is damaged, or no ROS 1 bag that can be read ({why})."
