"""Joint messages as they come: from a log that grows, from standard input, from a live server."""

import json
import struct
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, DataEnd, Footer, Message
from mcap.stream_reader import StreamReader

from wamctl.arm.errors import ConfigurationError, DataError

Messages = dict[str, tuple[list[int], list[bytes]]]
"""Per topic the instants of recording [ns], and the encoded messages."""

_Message = tuple[str, int, bytes]
"""Topic, instant of recording [ns], and the encoded message."""

_TOGETHER_NS = 200_000_000
_LOOK_S = 0.05
_PROTOCOL = "foxglove.sdk.v1"
_LIVE = struct.Struct("<BIQ")
_MESSAGE_DATA = 1


def messages(source: str, topics: tuple[str, ...], idle_s: float) -> Iterator[Messages]:
    """The messages of some topics in small batches, until the source ends.

    Args:
        source: path of an MCAP file that may still be written, `-`, or a ws:// address.
        topics: those that are wanted.
        idle_s: a file that has not grown for so long has ended [s].

    Raises:
        DataError: no such file, no MCAP, or no server.
    """
    if source.startswith(("ws://", "wss://")):
        yield from _together(_live(source, topics))
    elif source == "-":
        yield from _together(_mcap(sys.stdin.buffer, "standard input", topics))
    else:
        try:
            with Path(source).open("rb") as file:
                yield from _together(_mcap(_Growing(file, idle_s), source, topics))
        except OSError as error:
            raise DataError(f"{source} cannot be read ({error.strerror or error}).") from error


def _together(found: Iterator[_Message]) -> Iterator[Messages]:
    """Messages of a fifth of a second at a time: to decode them one by one would take longer."""
    batch: Messages = defaultdict(lambda: ([], []))
    first = None
    for topic, stamp, data in found:
        first = stamp if first is None else first
        if stamp - first > _TOGETHER_NS:
            yield dict(batch)
            batch.clear()
            first = stamp
        batch[topic][0].append(stamp)
        batch[topic][1].append(data)
    yield dict(batch)


class _Growing:
    """A file that is still written: reading waits for what is to come."""

    def __init__(self, file: IO[bytes], idle_s: float) -> None:
        self._file, self._idle_s = file, idle_s

    def read(self, count: int = -1) -> bytes:
        found, since = self._file.read(count), time.monotonic()
        while len(found) < count and time.monotonic() - since < self._idle_s:
            time.sleep(_LOOK_S)
            more = self._file.read(count - len(found))
            if more:
                found, since = found + more, time.monotonic()
        return found


def _mcap(stream: Any, name: str, topics: tuple[str, ...]) -> Iterator[_Message]:
    named: dict[int, str] = {}
    try:
        for record in StreamReader(stream).records:
            if isinstance(record, Channel):
                named[record.id] = record.topic
            if isinstance(record, DataEnd | Footer):
                break
            if isinstance(record, Message) and named.get(record.channel_id) in topics:
                yield named[record.channel_id], record.log_time, record.data
    except EndOfFile:
        pass
    except (McapError, struct.error) as error:
        raise DataError(f"{name} is no MCAP log that can be read ({error}).") from error


def _live(address: str, topics: tuple[str, ...]) -> Iterator[_Message]:
    """Messages of a server of Foxglove's WebSocket protocol, as `wamctl excite --live` starts."""
    try:
        from websockets.exceptions import ConnectionClosed, WebSocketException
        from websockets.sync.client import connect
    except ImportError as error:
        raise ConfigurationError(
            "ident watch", ["a live server needs websockets: pip install 'wam-ident[live]'"]
        ) from error
    try:
        with connect(address, subprotocols=[_PROTOCOL], max_size=None) as end:  # pyright: ignore[reportArgumentType]
            named: dict[int, str] = {}
            while True:
                try:
                    message = end.recv()
                except ConnectionClosed:
                    return
                if isinstance(message, str):
                    _subscribe(end, json.loads(message), topics, named)
                elif message[0] == _MESSAGE_DATA:
                    _, subscription, stamp = _LIVE.unpack_from(message)
                    yield named[subscription], stamp, bytes(message[_LIVE.size :])
    except (OSError, WebSocketException) as error:
        raise DataError(
            f"{address} does not answer ({error}): start `wamctl excite --live` first."
        ) from error


def _subscribe(
    end: Any, content: dict[str, Any], topics: tuple[str, ...], named: dict[int, str]
) -> None:
    wanted = [c for c in content.get("channels", []) if c["topic"] in topics]
    named |= {c["id"]: c["topic"] for c in wanted}
    if wanted:
        ids = [{"id": c["id"], "channelId": c["id"]} for c in wanted]
        end.send(json.dumps({"op": "subscribe", "subscriptions": ids}))
