"""One exchange a cycle on the bare bus: a question to all drives, and the position of each."""

from collections.abc import Sequence
from typing import Protocol

import can
import numpy as np

from wamctl.arm.arrays import Array
from wamctl.drives.answers import Answers
from wamctl.drives.bus import Channel, next_frame, send_all
from wamctl.drives.interface import CycleTiming, Readings
from wamctl.errors import BusStopError

_MOST_FRAMES = 200  # taken from the bus at one go: a flood must not hold the cycle for ever
_BUS_OFF = 0x40  # class of an error frame, in SocketCAN's identifier bits


class FrameReader(Protocol):
    """Reads the frames of one protocol."""

    def slot(self, frame: can.Message) -> int | None:
        """Place of the drive whose position the frame carries; None for any other frame."""
        ...

    def counts(self, slot: int, frame: can.Message) -> int:
        """The position in a frame for which `slot` gave a place [counts]."""
        ...

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        ...

    def hear(self, frame: can.Message) -> bool:
        """Take in any other frame; False if the protocol has none such."""
        ...


class AnswerCycle:
    """Asks all drives, and takes in their positions and whatever else is on the bus.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
        channel: the bus's name, and whether our own frames come back on it.
        answers: which frames belong to a cycle.
        reader: reads the frames.
    """

    def __init__(
        self, bus: can.BusABC, channel: Channel, answers: Answers, reader: FrameReader
    ) -> None:
        self._bus, self._channel = bus, channel
        self._answers, self._reader = answers, reader
        self._settled = True

    @property
    def missing(self) -> set[int]:
        """Places of the drives whose answer has not come in this cycle."""
        return self._answers.missing

    def begin(self) -> None:
        """Empty the queue, so that no frame of the last cycle passes for a new one.

        Raises:
            BusStopError: the bus does not receive.
        """
        self._answers.begin()
        try:
            for _ in range(_MOST_FRAMES):
                frame = self._bus.recv(0.0)
                if frame is None:
                    return
                slot = self._reader.slot(frame)
                if slot is None:
                    self._hear(frame)
                else:
                    self._answers.leave_out(slot)
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error

    def ask(self, questions: Sequence[can.Message], timing: CycleTiming) -> Array:
        """Position of every drive, shape (n,) [counts]; NaN where none came.

        After a cycle in which frames stayed away, those may still come, before the new ones: then
        the whole time is waited, and the last frame of each drive counts.

        Raises:
            BusStopError: the bus does not send or receive.
        """
        answers, reader = self._answers, self._reader
        counts = [np.nan] * len(answers.missing)
        try:
            for question in questions:
                self._bus.send(question)
            for _ in range(_MOST_FRAMES):
                frame = next_frame(self._bus, timing)
                if frame is None:
                    break
                slot = reader.slot(frame)
                if slot is None:
                    self._hear(frame)
                    continue
                if answers.admit(slot, timing.age(frame.timestamp)):
                    counts[slot] = reader.counts(slot, frame)
                if not answers.missing and self._settled:
                    break
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error
        answers.end()
        self._settled = not answers.missing
        return np.array(counts)

    def send(self, frames: Sequence[can.Message]) -> None:
        """Send frames in their order.

        Raises:
            BusStopError: the bus does not send.
        """
        try:
            send_all(self._bus, frames)
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error

    def readings(
        self, angle: Array, enabled: bool, disabled: bool, fault: str | None, stop: str | None
    ) -> Readings:
        """What the drives said in this cycle, with how they answered."""
        answers = self._answers
        return Readings(
            angle,
            _in_order(answers.missing),
            enabled,
            disabled,
            fault,
            stop,
            _in_order(answers.late),
            _in_order(answers.duplicates),
            _in_order(answers.out_of_order),
        )

    def _hear(self, frame: can.Message) -> None:
        if frame.is_error_frame and frame.arbitration_id & _BUS_OFF:
            raise BusStopError(f"bus {self._channel} went bus-off")
        if self._reader.is_own(frame):
            if not self._channel.may_echo:
                raise BusStopError(
                    f"another program commands the drives on bus {self._channel}: it sent frame "
                    f"{frame.arbitration_id:#05x}"
                )
            return
        if self._reader.hear(frame):
            return
        if frame.arbitration_id in self._answers.identifiers:
            self._answers.counters.malformed += 1
        else:
            self._answers.counters.foreign += 1

    def _failed(self, error: Exception) -> BusStopError:
        return BusStopError(f"bus {self._channel} failed ({error})")


def _in_order(slots: set[int]) -> tuple[int, ...]:
    return tuple(sorted(slots)) if slots else ()
