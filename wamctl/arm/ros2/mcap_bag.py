"""An MCAP file, whole or cut off at any byte, in the order of the file."""

import mmap
import struct
import zlib
from collections import defaultdict
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from wamctl.arm.errors import DataError
from wamctl.arm.ros2.bounds import Allowance, lz4_unpacked, zstd_unpacked
from wamctl.arm.ros2.part import BATCH, BATCH_BYTES, Batch, Cut, Part, Topic

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<BQHIQ8x")
_CHUNK = struct.Struct("<QQQII")
_UNREADABLE = (McapError, struct.error, ValueError, IndexError, RuntimeError, zstandard.ZstdError)


def mcap_parts(file: Path, stream: BinaryIO, topics: Collection[str]) -> Iterator[Part]:
    """What is in an `.mcap` file; a last part tells where the file is cut off, if it is.

    Raises:
        DataError: damaged inside.
    """
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        yield from _Walk(file, data, topics).parts()


class _Walk:
    """One pass over an MCAP file's records."""

    def __init__(self, file: Path, data: mmap.mmap, topics: Collection[str]) -> None:
        self._file = file
        self._data = data
        self._wanted = topics
        self._allowance = Allowance.of(file)
        self._types: dict[int, str] = {}
        self._topics: dict[int, str] = {}
        self._open = Batch(defaultdict(list), defaultdict(list))

    def parts(self) -> Iterator[Part]:
        position, whole = len(MAGIC), False
        while position + _RECORD.size <= len(self._data):
            opcode, length = _RECORD.unpack_from(self._data, position)
            end = position + _RECORD.size + length
            if opcode == 0 or end > len(self._data):
                break
            if opcode == Opcode.FOOTER:
                break
            whole = whole or opcode == Opcode.DATA_END
            if opcode == Opcode.MESSAGE:
                position = self._messages(self._data, position)
            else:
                try:
                    yield from self._record(opcode, position, end)
                except _UNREADABLE as error:
                    raise self._damaged(f"record of kind {opcode}", position) from error
                position = end
            if sum(map(len, self._open.messages.values())) >= BATCH:
                yield self._taken()
                self._forget(position)
        yield self._taken()
        if not whole:
            yield Cut(position)

    def _forget(self, position: int) -> None:
        """Gives back the memory of the pages before a byte, which otherwise fills with the file."""
        whole = position - position % mmap.PAGESIZE
        if whole:
            self._data.madvise(mmap.MADV_DONTNEED, 0, whole)

    def _taken(self) -> Batch:
        full = self._open
        self._open = Batch(defaultdict(list), defaultdict(list))
        return Batch(
            {topic: stamps for topic, stamps in full.log_ns.items() if stamps},
            {topic: messages for topic, messages in full.messages.items() if messages},
        )

    def _record(self, opcode: int, start: int, end: int) -> Iterator[Part]:
        body = slice(start + _RECORD.size, end)
        match opcode:
            case Opcode.CHUNK:
                yield from self._chunk(self._data[body], start)
            case Opcode.SCHEMA | Opcode.CHANNEL:
                yield from self._definition(opcode, self._data[body])
            case Opcode.METADATA:
                yield Metadata.read(ReadDataStream(BytesIO(self._data[body])))
            case Opcode.ATTACHMENT:
                data = self._data[body]
                (checksum,) = struct.unpack_from("<I", data, len(data) - 4)
                if checksum and checksum != zlib.crc32(data[:-4]):
                    raise self._damaged("attachment", start)
                yield Attachment.read(ReadDataStream(BytesIO(data)))

    def _definition(self, opcode: int, data: bytes) -> Iterator[Topic]:
        stream = ReadDataStream(BytesIO(data))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._types[schema.id] = schema.name
            return
        channel = Channel.read(stream)
        if channel.id not in self._topics:
            self._topics[channel.id] = channel.topic
            kind = self._types.get(channel.schema_id, "message without type")
            yield Topic(channel.topic, kind, channel.message_encoding)

    def _chunk(self, record: bytes, start: int) -> Iterator[Part]:
        data = self._unpacked(record, start)
        position = 0
        while position < len(data):
            if position + _RECORD.size > len(data):
                raise self._damaged("chunk", start)
            opcode, length = _RECORD.unpack_from(data, position)
            end = position + _RECORD.size + length
            if end > len(data):
                raise self._damaged("chunk", start)
            if opcode == Opcode.MESSAGE:
                position = self._messages(data, position)
                if sum(map(len, self._open.messages.values())) >= BATCH:
                    yield self._taken()
                continue
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                yield from self._definition(opcode, data[position + _RECORD.size : end])
            position = end

    def _messages(self, data: bytes | mmap.mmap, start: int) -> int:
        """Takes whole messages up to the next other record; the byte after them."""
        batch, unpack = self._open, _MESSAGE.unpack_from
        takers = {
            channel: (batch.log_ns[topic].append, batch.messages[topic].append)
            for channel, topic in self._topics.items()
            if topic in self._wanted
        }
        position, size, opcode = start, len(data), int(Opcode.MESSAGE)
        if _RECORD.unpack_from(data, start)[1] < _MESSAGE.size - _RECORD.size:
            raise self._damaged("message", start)
        last = min(position + BATCH_BYTES, size - _MESSAGE.size)
        while position <= last and data[position] == opcode:
            _, length, channel, _, log_ns = unpack(data, position)
            end = position + _RECORD.size + length
            if end > size:
                break
            if length < _MESSAGE.size - _RECORD.size:
                break
            if channel in takers:
                log, message = takers[channel]
                log(log_ns)
                message(data[position + _MESSAGE.size : end])
            position = end
        return position

    def _unpacked(self, record: bytes, start: int) -> bytes:
        _, _, size, checksum, name_length = _CHUNK.unpack_from(record)
        body = _CHUNK.size + name_length + 8
        self._allowance.take(size)
        compression = record[_CHUNK.size : _CHUNK.size + name_length].decode()
        match compression:
            case "zstd":
                data = zstd_unpacked(record[body:], size)
            case "lz4":
                data = lz4_unpacked(record[body:], size)
            case "":
                data = record[body:]
            case _:
                raise DataError(
                    f"{self._file} is compressed with {compression!r}:"
                    " only zstd and lz4 can be read."
                )
        if len(data) != size or (checksum and zlib.crc32(data) != checksum):
            raise self._damaged("chunk", start)
        return data

    def _damaged(self, what: str, start: int) -> DataError:
        return DataError(
            f"{self._file} is damaged: the {what} at byte {start} fails its check;"
            " copy the file again."
        )
