"""The cycle of classic Pucks on the bare bus: poll, positions, torques, at times one question."""

import can
import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import PuckDrivesSection
from wamctl.drives.answer_cycle import AnswerCycle
from wamctl.drives.answers import Answers
from wamctl.drives.bus import Channel
from wamctl.drives.interface import CycleTiming, Readings
from wamctl.puck import frames
from wamctl.puck.effective_torque import EffectiveTorque
from wamctl.puck.enumerations import HOST
from wamctl.puck.supervision import Supervision
from wamctl.puck.wiring import CycleFrames, is_plain, message

_REPEAT = 10  # cycles after which an order to idle that was not followed is sent again


class Cycle:
    """Positions, torques and modes of n classic Pucks.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
        channel: the bus's name and kind.
        drives: nodes and units.
        wires: the frames.
        supervision: what is asked beside them.
        acting: which torque acts when.
        answers: which frames answer a poll.
    """

    def __init__(
        self,
        bus: can.BusABC,
        channel: Channel,
        drives: PuckDrivesSection,
        wires: CycleFrames,
        supervision: Supervision,
        acting: EffectiveTorque,
        answers: Answers,
    ) -> None:
        self._wires, self._supervision, self._acting = wires, supervision, acting
        self.counters = answers.counters
        self._exchange = AnswerCycle(bus, channel, answers, self)
        self._rad_per_count = 2.0 * np.pi / np.array(drives.counts_per_revolution)
        self._units_per_nm = np.array(drives.torque_units_per_nm, dtype=float)
        self._has_goal = self._must_idle = False
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

        Raises:
            BusStopError: the bus does not send or receive.
        """
        self._count += 1
        self._exchange.begin()
        self._acting.polled()
        return self._readings(self._exchange.ask((self._wires.poll,), timing))

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
        torques = self._wires.torques(units.astype(int).tolist()) if self._has_goal else []
        self._exchange.send((*torques, *self._aside()))
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

    def slot(self, frame: can.Message) -> int | None:
        """Place of the motor whose position the frame carries; None for any other frame."""
        slot = self._wires.slot_of.get(frame.arbitration_id)
        if slot is None or len(frame.data) != self._wires.lengths[slot] or frame.data[0] & 0xC0:
            return None
        return slot if is_plain(frame) else None

    def counts(self, slot: int, frame: can.Message) -> int:
        """The position in a motor's frame [counts]; its joint encoder's stays unused."""
        return frames.decode_position(frame.data[:3])

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        return is_plain(frame) and frames.address(frame.arbitration_id).sender == HOST

    def hear(self, frame: can.Message) -> bool:
        """Take in a frame from outside the cycle; False if nobody sends such a frame."""
        can_id = frame.arbitration_id
        if can_id == self._wires.alarm_id:
            self._supervision.alarm()
            return True
        return is_plain(frame) and self._is_answer(can_id, bytes(frame.data))

    def _is_answer(self, can_id: int, data: bytes) -> bool:
        node = self._wires.node_of.get(can_id)
        return node is not None and self._supervision.hear(node, data)

    def _readings(self, counts: Array) -> Readings:
        watched = self._supervision
        if self._exchange.missing:
            watched.alarm()
        return self._exchange.readings(
            self.angle(counts), watched.enabled, watched.disabled, watched.fault, watched.too_hot
        )
