"""Who may watch: the door before the live view's server.

A browser lets any web page open a WebSocket to this machine, and tells by `Origin` which page it
is; a page whose name was bound to 127.0.0.1 afterwards shows by `Host`. So only Foxglove, pages of
this machine, and programs that are no browser come through, and only so many at once. What a client
sends is never printed.
"""

import asyncio
import contextlib
import threading
from collections.abc import Coroutine
from typing import Any
from urllib.parse import urlsplit

MOST_CLIENTS = 8
_HERE = ("127.0.0.1", "localhost", "::1")
_FOXGLOVE = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://")
"""Foxglove in a browser, and on the desktop."""

_MOST_HEAD = 16_384
_HEAD_S = 2.0
_CHUNK = 65_536


def admits(head: bytes) -> bool:
    """Whether the head of a request may pass: of this machine's name, and of a page that may watch.

    Args:
        head: request line and header lines.
    """
    fields: dict[str, list[str]] = {}
    for line in head.decode("latin-1").split("\r\n")[1:]:
        name, colon, value = line.partition(":")
        if colon:
            fields.setdefault(name.strip().lower(), []).append(value.strip())
    hosts, origins = fields.get("host", []), fields.get("origin", [])
    if len(hosts) != 1 or len(origins) > 1 or _name(f"//{hosts[0]}") not in _HERE:
        return False
    origin = origins[0] if origins else ""
    of_here = origin.startswith(("http://", "https://")) and _name(origin) in _HERE
    return not origins or origin in _FOXGLOVE or of_here


def _name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


class Gate:
    """Listens on the local interface, and passes on whom it admits.

    Args:
        inner: address and port of the server behind it.
    """

    def __init__(self, inner: tuple[str, int]) -> None:
        self._inner = inner
        self._clients = 0
        self._loop = asyncio.new_event_loop()

    def open(self, port: int) -> None:
        """Begin to listen.

        Raises:
            OSError: the port cannot be used.
        """
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        self._run(asyncio.start_server(self._enter, "127.0.0.1", port, limit=_MOST_HEAD))

    def _run(self, work: Coroutine[Any, Any, Any]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _enter(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            # An end that was closed with a request unread would be reset, its answer lost.
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _HEAD_S)
            if not admits(head):
                await _refuse(writer, "403 Forbidden")
            elif self._clients >= MOST_CLIENTS:
                await _refuse(writer, "503 Service Unavailable")
            else:
                await self._pass_on(head, reader, writer)
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            writer.close()

    async def _pass_on(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._clients += 1
        try:
            inner_reader, inner_writer = await asyncio.open_connection(*self._inner)
            inner_writer.write(head)
            both = [
                asyncio.ensure_future(_copy(reader, inner_writer)),
                asyncio.ensure_future(_copy(inner_reader, writer)),
            ]
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for end in (writer, inner_writer):
                end.close()
            await asyncio.gather(*both, return_exceptions=True)
        finally:
            self._clients -= 1


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_CHUNK):
        writer.write(data)
        await writer.drain()


async def _refuse(writer: asyncio.StreamWriter, status: str) -> None:
    with contextlib.suppress(OSError):
        writer.write(
            f"HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n".encode()
        )
        await writer.drain()
    writer.close()
