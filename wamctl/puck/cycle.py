"""The cycle of classic Pucks on the bare bus: poll, positions, torques, at times one question."""

import can
import numpy as np
from numpy.typing import NDArray

from wamctl.arm.config import PuckDrivesSection
from wamctl.drives.answers import Answers
from wamctl.drives.bus import next_frame, send_all
from wamctl.drives.interface import CycleTiming, Readings
from wamctl.errors import BusStopError
from wamctl.puck import frames
from wamctl.puck.effective_torque import EffectiveTorque
from wamctl.puck.supervision import Supervision
from wamctl.puck.wiring import CycleFrames, is_plain, message

Array = NDArray[np.floating]

_REPEAT = 10  # cycles after which an order to idle that was not followed is sent again
_MOST_FRAMES = 200  # taken from the bus at one go: a flood must not hold the cycle for ever
_BUS_OFF = 0x40  # class of an error frame, in SocketCAN's identifier bits


class Cycle:
    """Positions, torques and modes of n classic Pucks.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
        channel: what to call the bus.
        drives: nodes and units.
        wires: the frames.
        supervision: what is asked beside them.
        acting: which torque acts when.
        answers: which frames answer a poll.
    """

    def __init__(
        self,
        bus: can.BusABC,
        channel: str,
        drives: PuckDrivesSection,
        wires: CycleFrames,
        supervision: Supervision,
        acting: EffectiveTorque,
        answers: Answers,
    ) -> None:
        self._bus, self._channel = bus, channel
        self._wires, self._supervision, self._acting = wires, supervision, acting
        self._answers, self.counters = answers, answers.counters
        self._rad_per_count = 2.0 * np.pi / np.array(drives.counts_per_revolution)
        self._units_per_nm = np.array(drives.torque_units_per_nm, dtype=float)
        self._has_goal = self._must_idle = False
        self._settled = True
        self._count = 0
        self._ordered_in = -_REPEAT

    def go(self, wants_torque: bool) -> None:
        """From now on the arm is to give torque, or none."""
        self._has_goal, self._must_idle, self._ordered_in = True, not wants_torque, -_REPEAT
        self._supervision.go(wants_torque)

    def angle(self, counts: Array) -> Array:
        """Motor angle from the arm's zero pose [rad], shape (n,), of position counts."""
        return counts * self._rad_per_count

    def sample(self, timing: CycleTiming) -> Readings:
        """Poll, then the position of every motor.

        After a cycle in which frames stayed away, those may still come, before the new ones: then
        the whole time is waited, and the last frame of each motor counts.

        Raises:
            BusStopError: the bus does not send or receive.
        """
        counts = np.full(len(self._units_per_nm), np.nan)
        answers = self._answers
        answers.begin()
        self._count += 1
        try:
            self._discard_late()
            self._acting.polled()
            self._bus.send(self._wires.poll)
            for _ in range(_MOST_FRAMES):
                frame = next_frame(self._bus, timing)
                if frame is None:
                    break
                slot = self._slot(frame)
                if slot is None:
                    self._hear(frame)
                    continue
                if answers.admit(slot, timing.age(frame.timestamp)):
                    counts[slot] = frames.decode_position(frame.data[:3])
                if not answers.missing and self._settled:
                    break
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error
        answers.end()
        self._settled = not answers.missing
        return self._readings(counts)

    def send(self, tau_motor: Array) -> Array:
        """Torque frames [N m], shape (n,), then at times a question or an order to idle.

        Returns the mean torque between this sampling instant and the next, as rounded. Before
        there is a goal, no torque is sent: without its heartbeat, an arm that somebody activates
        meanwhile falls back to IDLE.

        Raises:
            BusStopError: the bus does not send.
        """
        units = np.rint(tau_motor * self._units_per_nm)
        units = np.clip(units, -frames.TORQUE_MAX, frames.TORQUE_MAX)
        if self._supervision.yields or not self._has_goal:
            units = np.zeros_like(units)
        acting = self._acting.mean(units / self._units_per_nm)
        try:
            torques = self._wires.torques(units.astype(int).tolist()) if self._has_goal else []
            send_all(self._bus, (*torques, *self._aside()))
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error
        return acting

    def zero_torque_frames(self) -> list[can.Message]:
        """Frames that take all torque away at once."""
        return [*self._wires.torques([0] * len(self._units_per_nm)), *self._wires.to_idle]

    def _aside(self) -> tuple[can.Message, ...]:
        waits = self._count - self._ordered_in < _REPEAT
        if self._must_idle and not self._supervision.disabled and not waits:
            self._ordered_in = self._count
            return self._wires.to_idle
        question = self._supervision.next_question(self._count)
        if question is None:
            return ()
        return (message(question.identifier, frames.encode_get(question.property_id)),)

    def _discard_late(self) -> None:
        """Empty the queue before the poll: no frame of the last cycle may pass for a new one."""
        for _ in range(_MOST_FRAMES):
            frame = self._bus.recv(0.0)
            if frame is None:
                return
            slot = self._slot(frame)
            if slot is None:
                self._hear(frame)
            else:
                self._answers.leave_out(slot)

    def _slot(self, frame: can.Message) -> int | None:
        """Place of the motor whose position the frame carries; None for any other frame."""
        slot = self._wires.slot_of.get(frame.arbitration_id)
        if slot is None or len(frame.data) != self._wires.lengths[slot] or frame.data[0] & 0xC0:
            return None
        return slot if is_plain(frame) else None

    def _hear(self, frame: can.Message) -> None:
        can_id = frame.arbitration_id
        if frame.is_error_frame and can_id & _BUS_OFF:
            raise BusStopError(f"bus {self._channel} went bus-off")
        if can_id in self._wires.slot_of:
            self.counters.malformed += 1
        elif can_id == self._wires.alarm_id:
            self._supervision.alarm()
        elif not (is_plain(frame) and self._is_answer(can_id, bytes(frame.data))):
            self.counters.foreign += 1

    def _is_answer(self, can_id: int, data: bytes) -> bool:
        node = self._wires.node_of.get(can_id)
        return node is not None and self._supervision.hear(node, data)

    def _readings(self, counts: Array) -> Readings:
        watched, answers = self._supervision, self._answers
        if answers.missing:
            watched.alarm()
        return Readings(
            self.angle(counts),
            tuple(sorted(answers.missing)),
            watched.enabled,
            watched.disabled,
            watched.fault,
            watched.too_hot,
            tuple(sorted(answers.late)),
            tuple(sorted(answers.duplicates)),
            tuple(sorted(answers.out_of_order)),
        )

    def _failed(self, error: Exception) -> BusStopError:
        return BusStopError(f"bus {self._channel} failed ({error})")
