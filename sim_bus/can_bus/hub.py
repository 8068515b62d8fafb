"""The meeting point of the simulated devices' frames and the programs on the bus."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.waiting import Source


class Received(NamedTuple):
    """A frame that a program has sent.

    Attributes:
        frame: the frame.
        sender: the program's connection.
        sent_ns: when it was sent [ns, monotonic clock], so that a simulation that was held up does
            not take the frame for a later one; None where nobody knows.
    """

    frame: Frame
    sender: object
    sent_ns: int | None


class Hub(Protocol):
    """Programs on one side of the wire.

    Attributes:
        gathers: whether a call of the system costs so much more than a frame that frames which
            follow each other without a pause should be given out together.
    """

    gathers: bool

    def sources(self) -> Sequence[Source]:
        """Descriptors to `select` for reading."""
        ...

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        """All frames that have come in, after `select` has found these sources readable."""
        ...

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        """Give frames to all programs but their sender, by the next `flush`.

        Args:
            frames: the frames.
            sender: who does not get them.
            time_ns: when they passed, where they do not say otherwise [ns].
        """
        ...

    def settle(self, sender: object, time_ns: int) -> None:
        """A program has been given all that follows from its oldest open frame; see `flush`.

        Args:
            sender: the program.
            time_ns: the bus's time by then [ns].
        """
        ...

    def flush(self) -> None:
        """Let the programs have all that is for them."""
        ...

    def close(self) -> None:
        """Leave."""
        ...
