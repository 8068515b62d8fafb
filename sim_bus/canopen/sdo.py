"""The SDO server of a drive (CiA 301, chapter 7.2.4.3): expedited and segmented transfers."""

import struct
from collections.abc import Callable

from sim_bus.canopen.dictionary import Abort, Key, SdoAbort

Read = Callable[[Key], bytes]
Write = Callable[[Key, bytes], None]

_HEAD = struct.Struct("<BHB")
_TOGGLE = 0x10


class SdoServer:
    """One request in, one response out.

    Args:
        read: gives the value of an entry.
        write: stores a value; both raise `SdoAbort` to refuse.
    """

    def __init__(self, read: Read, write: Write) -> None:
        self._read = read
        self._write = write
        self._key: Key = (0, 0)
        self._buffer: bytearray | None = None
        self._uploading = False
        self._toggle = 0

    def answer(self, request: bytes) -> bytes | None:
        """The response to a request; None to an abort, or to a frame that is too short."""
        if len(request) < 8:
            return None
        command = request[0] >> 5
        if command == 4:
            self._buffer = None
            return None
        if command in (1, 2):
            self._key = struct.unpack_from("<HB", request, 1)
        try:
            return self._dispatch(command, request)
        except SdoAbort as abort:
            self._buffer = None
            return _HEAD.pack(0x80, *self._key) + struct.pack("<I", abort.code)

    def _dispatch(self, command: int, request: bytes) -> bytes:
        if command == 1:
            return self._start_download(request)
        if command == 2:
            return self._start_upload()
        if self._buffer is not None and command == 0 and not self._uploading:
            return self._download_segment(request)
        if self._buffer is not None and command == 3 and self._uploading:
            return self._upload_segment(request)
        if command in (5, 6):
            self._key = struct.unpack_from("<HB", request, 1)
        raise SdoAbort(Abort.COMMAND)

    def _start_download(self, request: bytes) -> bytes:
        command = request[0]
        if command & 0x02:
            told = command & 0x01  # the size; else that of the object
            size = 4 - (command >> 2 & 3) if told else min(4, len(self._read(self._key)))
            self._buffer = None
            self._write(self._key, request[4 : 4 + size])
        else:
            self._buffer, self._uploading, self._toggle = bytearray(), False, 0
        return _HEAD.pack(0x60, *self._key) + bytes(4)

    def _download_segment(self, request: bytes) -> bytes:
        buffer = self._alternated(request)
        buffer += request[1 : 8 - (request[0] >> 1 & 7)]
        response = bytes([0x20 | self._toggle]) + bytes(7)
        self._toggle ^= _TOGGLE
        if request[0] & 0x01:
            self._buffer = None
            self._write(self._key, bytes(buffer))
        return response

    def _start_upload(self) -> bytes:
        data = self._read(self._key)
        if len(data) <= 4:
            self._buffer = None
            return _HEAD.pack(0x43 | (4 - len(data)) << 2, *self._key) + data.ljust(4, b"\0")
        self._buffer, self._uploading, self._toggle = bytearray(data), True, 0
        return _HEAD.pack(0x41, *self._key) + struct.pack("<I", len(data))

    def _upload_segment(self, request: bytes) -> bytes:
        buffer = self._alternated(request)
        part = bytes(buffer[:7])
        del buffer[:7]
        head = self._toggle | (7 - len(part)) << 1 | (0 if buffer else 1)
        self._toggle ^= _TOGGLE
        if not buffer:
            self._buffer = None
        return bytes([head]) + part.ljust(7, b"\0")

    def _alternated(self, request: bytes) -> bytearray:
        if self._buffer is None or request[0] & _TOGGLE != self._toggle:
            raise SdoAbort(Abort.TOGGLE_BIT)
        return self._buffer
