"""What a log may unpack to: bounds that keep a reader's memory and effort in proportion."""

from dataclasses import dataclass
from pathlib import Path

import lz4.frame
import zstandard

from wamctl.arm.errors import DataError

MOST_RATIO = 200
"""A log unpacks to so many times its own size at most; joint logs reach 5 to 30."""

FREE_BYTES = 1 << 26
"""Unpacked bytes that are allowed whatever the file's size."""

MOST_CHUNK = 1 << 28
"""Unpacked bytes of one part of a log at most."""

_WINDOW = 1 << 27  # of zstd's memory; its own programs make no larger ones by default


@dataclass
class Allowance:
    """What is left of what one file may unpack to.

    Attributes:
        file: the file.
        left: bytes.
    """

    file: Path
    left: int

    @classmethod
    def of(cls, file: Path) -> "Allowance":
        """What a file may unpack to.

        Raises:
            DataError: a file that is gone.
        """
        try:
            return cls(file, FREE_BYTES + MOST_RATIO * file.stat().st_size)
        except OSError as error:
            raise DataError(f"{file} cannot be read ({error.strerror or error}).") from error

    def take(self, size: int) -> None:
        """Count bytes before they are unpacked.

        Raises:
            DataError: more than the file may unpack to.
        """
        self.left -= size
        if size > MOST_CHUNK or self.left < 0:
            raise DataError(
                f"{self.file} unpacks to more than {MOST_RATIO} times its size plus"
                f" {FREE_BYTES >> 20} MB, or to a part of more than {MOST_CHUNK >> 20} MB:"
                " no log of joints does; it is damaged, or was made to fill the memory."
            )


def zstd_unpacked(data: bytes, size: int) -> bytes:
    """What zstd packed, up to one byte more than the size that is stated."""
    with zstandard.ZstdDecompressor(max_window_size=_WINDOW).stream_reader(data) as reader:
        return reader.read(size + 1)


def lz4_unpacked(data: bytes, size: int) -> bytes:
    """What lz4 packed, up to one byte more than the size that is stated."""
    return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
