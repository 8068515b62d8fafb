"""The parts of a bag, as the readers of its kinds of file give them."""

from dataclasses import dataclass

from mcap.records import Attachment, Metadata

BATCH = 4096
"""Messages are handed on in batches of about this many."""

BATCH_BYTES = 2**20
"""Where messages may be of any size, a batch has about as many bytes."""


@dataclass(frozen=True)
class Topic:
    """A topic of the bag, told when it is met."""

    name: str
    type: str
    encoding: str


@dataclass(frozen=True)
class Batch:
    """Some messages in the order of the file.

    Attributes:
        log_ns: per topic the instants of recording [ns].
        messages: per topic the encoded messages.
    """

    log_ns: dict[str, list[int]]
    messages: dict[str, list[bytes]]


@dataclass(frozen=True)
class Cut:
    """The file ends before its data do; everything up to here was whole."""

    byte: int


Part = Topic | Batch | Attachment | Metadata | Cut
