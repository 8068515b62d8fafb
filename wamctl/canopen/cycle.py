"""The cycle of torque drives on the bare bus: SYNC out, positions in, torques out, nothing else."""

import can
import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import BusSection, CanopenDrivesSection
from wamctl.canopen import ds402, pdo
from wamctl.canopen import identifiers as ids
from wamctl.canopen.ds402 import Controlword, Goal, State
from wamctl.canopen.inputs import StopInput, Temperatures
from wamctl.canopen.sdo import is_data, is_plain
from wamctl.canopen.supervision import Supervision
from wamctl.drives.answer_cycle import AnswerCycle
from wamctl.drives.answers import Answers
from wamctl.drives.bus import Channel
from wamctl.drives.interface import CycleTiming, Readings

_OPERATIONAL = 0x05
_HEARTBEAT_S = 0.1
_REPEAT = 10  # cycles after which a command that was not followed is sent again


class Cycle:
    """Process data of n drives, and the walk through their states.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
        drives: nodes, wiring and units.
        names: what to call each drive.
        channel: the bus's name and kind.
        section: cycle time and kind of frames.
    """

    def __init__(
        self,
        bus: can.BusABC,
        drives: CanopenDrivesSection,
        names: tuple[str, ...],
        channel: Channel,
        section: BusSection,
    ) -> None:
        n, fd, period_s = len(drives.node_ids), section.is_fd, section.period_s
        self.statuswords = [0] * n
        self._names, self._period_s = names, period_s
        self._supervision = Supervision(drives.node_ids, names, drives.heartbeat_ms / 1000)
        self._inputs = (Temperatures(drives, names), StopInput(drives))
        self._slots = {pdo.position_id(node): slot for slot, node in enumerate(drives.node_ids)}
        answers = Answers(names, list(self._slots), period_s)
        self.counters = answers.counters
        self._exchange = AnswerCycle(bus, channel, answers, self)
        self._sync = pdo.message(ids.SYNC, 0, fd)
        self._heartbeat = pdo.message(ids.MASTER_HEARTBEAT, 1, fd)
        self._heartbeat.data[0] = _OPERATIONAL
        self._own = pdo.received_ids(drives) | ids.of_master(drives.node_ids)
        self._frames = pdo.frames(drives, fd)
        self._heartbeat_cycles = max(1, round(_HEARTBEAT_S / period_s))
        self._rad_per_count = 2 * np.pi / np.array(drives.counts_per_revolution)
        self._zero_counts = np.array(drives.zero_counts)
        self._permille_per_nm = 1000.0 / np.array(drives.rated_torque_nm)
        self._states: list[State | None] = [None] * n
        self._read_statuswords: list[int] = []
        self._enabled = self._disabled = False
        self._goal = Goal.DISABLED
        self._commands: list[int] = [Controlword.DISABLE_VOLTAGE] * n
        self._choose_commands()
        self._sent_in = [0] * n
        self._arrived = False
        self._count = 0

    def start(self) -> None:
        """Count from zero; what was heard before is forgotten."""
        self._count = 0
        self._supervision.start(0.0)
        for watched in self._inputs:
            watched.start()

    def go(self, goal: Goal) -> None:
        """From now on, walk the drives towards a goal."""
        self._goal, self._arrived = goal, False
        self._choose_commands()

    def angle(self, counts: Array) -> Array:
        """Motor angle from the arm's zero pose [rad], shape (n,), of position counts."""
        return (counts - self._zero_counts) * self._rad_per_count

    def sample(self, timing: CycleTiming) -> Readings:
        """SYNC, then statusword and position of every drive.

        Raises:
            BusStopError: the bus does not send or receive.
        """
        self._count += 1
        self._exchange.begin()
        beats = self._count % self._heartbeat_cycles == 0
        questions = (self._sync, self._heartbeat) if beats else (self._sync,)
        return self._readings(self._exchange.ask(questions, timing))

    def send(self, tau_motor: Array, at_once: bool = False) -> Array:
        """Controlwords where a state is to change, and the torque frames [N m], shape (n,).

        Args:
            tau_motor: the torques.
            at_once: applied on arrival, before all else, and at the next SYNC again.

        Raises:
            BusStopError: the bus does not send.
        """
        permille = [round(x) for x in (tau_motor * self._permille_per_nm).tolist()]
        commands = self._new_commands()
        torques = self._frames.torques(permille, self._commands)
        urgent = self._frames.twins() if at_once else ()
        self._exchange.send((*urgent, *commands, *torques))
        return np.array(permille) / self._permille_per_nm

    def zero_torque_frames(self) -> list[can.Message]:
        """Frames that take all torque away at once."""
        n = len(self.statuswords)
        words = [Controlword.DISABLE_VOLTAGE] * n
        commands = [self._frames.command(slot, word) for slot, word in enumerate(words)]
        torques = self._frames.torques([0] * n, words)
        return [*self._frames.twins(), *torques, *filter(None, commands), self._sync]

    def _new_commands(self) -> list[can.Message]:
        """Frames for the controlwords that have changed, or were not followed."""
        if self._arrived and self._wanted == self._commands:
            return []
        messages = []
        for slot, word in enumerate(self._wanted):
            waits = not self._arrived and self._count - self._sent_in[slot] >= _REPEAT
            if word == self._commands[slot] and not waits:
                continue
            self._commands[slot] = word
            self._sent_in[slot] = self._count
            message = self._frames.command(slot, word)
            if message is not None:
                messages.append(message)
        return messages

    def slot(self, frame: can.Message) -> int | None:
        """Place of the drive whose position the frame carries; None for any other frame."""
        slot = self._slots.get(frame.arbitration_id)
        if slot is None or len(frame.data) != pdo.POSITION_FRAME.size or not is_plain(frame):
            return None
        return slot

    def counts(self, slot: int, frame: can.Message) -> int:
        """The position in a drive's frame [counts]; its statusword is kept."""
        self.statuswords[slot], counts = pdo.POSITION_FRAME.unpack(frame.data)
        return counts

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        return frame.arbitration_id in self._own and is_data(frame)

    def hear(self, frame: can.Message) -> bool:
        """Take in a frame from outside the cycle; False if nobody sends such a frame."""
        can_id = frame.arbitration_id
        return is_plain(frame) and (
            self._supervision.hear(can_id, frame.data, self._now_s)
            or any(watched.hear(can_id, frame.data) for watched in self._inputs)
        )

    def _readings(self, counts: Array) -> Readings:
        if self.statuswords != self._read_statuswords:
            self._read_states()
        enabled, disabled = self._enabled, self._disabled
        fault = self._supervision.fault(self._now_s) or self._state_fault()
        self._arrived |= enabled if self._goal is Goal.ENABLED else disabled
        stops = [watched.reason() for watched in self._inputs]
        stop = next(filter(None, stops), None)
        return self._exchange.readings(self.angle(counts), enabled, disabled, fault, stop)

    def _read_states(self) -> None:
        self._read_statuswords = self.statuswords.copy()
        self._states = [ds402.state(word) for word in self.statuswords]
        self._enabled = all(s is State.OPERATION_ENABLED for s in self._states)
        self._disabled = not any(s in ds402.ENERGISED for s in self._states)
        self._choose_commands()

    def _choose_commands(self) -> None:
        self._wanted = [ds402.controlword(state, self._goal) for state in self._states]

    def _state_fault(self) -> str | None:
        if self._enabled:
            return None
        must_be_enabled = self._goal is Goal.ENABLED and self._arrived
        for name, state, word in zip(self._names, self._states, self.statuswords, strict=True):
            if state in ds402.FAULTY or (must_be_enabled and state is not State.OPERATION_ENABLED):
                shown = state.words if state is not None else "no state of CiA 402"
                return f"{name} shows {shown} (statusword 0x{word:04X})"
        return None

    @property
    def _now_s(self) -> float:
        return self._count * self._period_s
