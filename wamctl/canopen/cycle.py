"""The cycle of torque drives on the bare bus: SYNC out, positions in, torques out, nothing else."""

import can
import numpy as np
from numpy.typing import NDArray

from wamctl.arm.config import BusSection, CanopenDrivesSection
from wamctl.canopen import ds402, pdo
from wamctl.canopen.ds402 import Controlword, Goal, State
from wamctl.canopen.inputs import Inputs
from wamctl.canopen.sdo import is_plain
from wamctl.canopen.supervision import Supervision
from wamctl.drives.answers import Answers
from wamctl.drives.bus import next_frame, send_all
from wamctl.drives.interface import CycleTiming, Readings
from wamctl.errors import BusStopError

Array = NDArray[np.floating]

_MASTER_HEARTBEAT_ID, _OPERATIONAL = 0x77F, 0x05
_HEARTBEAT_S = 0.1
_REPEAT = 10  # cycles after which a command that was not followed is sent again
_MOST_FRAMES = 200  # taken from the bus at one go: a flood must not hold the cycle for ever
_UNHEARD_CYCLES = 5  # without the stop switch's state
_BUS_OFF = 0x40  # class of an error frame, in SocketCAN's identifier bits


class Cycle:
    """Process data of n drives, and the walk through their states.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
        drives: nodes, wiring and units.
        names: what to call each drive.
        channel: what to call the bus.
        section: cycle time and kind of frames.
    """

    def __init__(
        self,
        bus: can.BusABC,
        drives: CanopenDrivesSection,
        names: tuple[str, ...],
        channel: str,
        section: BusSection,
    ) -> None:
        n, fd, period_s = len(drives.node_ids), section.is_fd, section.period_s
        self.words = [0] * n
        self._bus, self._names, self._channel, self._period_s = bus, names, channel, period_s
        self._supervision = Supervision(drives.node_ids, names, drives.heartbeat_ms / 1000)
        self._inputs = Inputs(drives, names, _UNHEARD_CYCLES)
        self._slots = {0x180 + node: slot for slot, node in enumerate(drives.node_ids)}
        self._answers = Answers(names, list(self._slots), period_s)
        self.counters = self._answers.counters
        self._sync = pdo.message(pdo.SYNC_ID, 0, fd)
        self._heartbeat = pdo.message(_MASTER_HEARTBEAT_ID, 1, fd)
        self._heartbeat.data[0] = _OPERATIONAL
        self._echoes = {pdo.SYNC_ID, _MASTER_HEARTBEAT_ID} | pdo.received_ids(drives)
        self._frames = pdo.frames(drives, fd)
        self._heartbeat_cycles = max(1, round(_HEARTBEAT_S / period_s))
        self._rad_per_count = 2 * np.pi / np.array(drives.counts_per_revolution)
        self._zero_counts = np.array(drives.zero_counts)
        self._permille_per_nm = 1000.0 / np.array(drives.rated_torque_nm)
        self._states: list[State | None] = [None] * n
        self._read_words: list[int] = []
        self._enabled = self._disabled = False
        self._goal = Goal.DISABLED
        self._commands: list[int] = [Controlword.DISABLE_VOLTAGE] * n
        self._choose_commands()
        self._sent_in = [0] * n
        self._arrived = False
        self._settled = True
        self._count = 0

    def start(self) -> None:
        """Count from zero; what was heard before is forgotten."""
        self._count = 0
        self._supervision.start(0.0)
        self._inputs.start()

    def go(self, goal: Goal) -> None:
        """From now on, walk the drives towards a goal."""
        self._goal, self._arrived = goal, False
        self._choose_commands()

    def angle(self, counts: Array) -> Array:
        """Motor angle from the arm's zero pose [rad], shape (n,), of position counts."""
        return (counts - self._zero_counts) * self._rad_per_count

    def sample(self, timing: CycleTiming) -> Readings:
        """SYNC, then statusword and position of every drive.

        After a cycle in which frames stayed away, those may still come, before the new ones: then
        the whole time is waited, and the last frame of each drive counts.

        Raises:
            BusStopError: the bus does not send or receive.
        """
        counts = [np.nan] * len(self.words)
        answers = self._answers
        answers.begin()
        self._count += 1
        try:
            self._discard_late()
            self._bus.send(self._sync)
            if self._count % self._heartbeat_cycles == 0:
                self._bus.send(self._heartbeat)
            for _ in range(_MOST_FRAMES):
                message = next_frame(self._bus, timing)
                if message is None:
                    break
                slot = self._slots.get(message.arbitration_id)
                if slot is None or not _carries_position(message):
                    self._hear(message)
                    continue
                if answers.admit(slot, timing.age(message.timestamp)):
                    self.words[slot], counts[slot] = pdo.POSITION_FRAME.unpack(message.data)
                if not answers.missing and self._settled:
                    break
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error
        answers.end()
        self._settled = not answers.missing
        return self._readings(np.array(counts))

    def send(self, tau_motor: Array) -> Array:
        """Controlwords where a state is to change, and the torque frames [N m], shape (n,).

        Raises:
            BusStopError: the bus does not send.
        """
        permille = [round(x) for x in (tau_motor * self._permille_per_nm).tolist()]
        try:
            commands = self._new_commands()
            send_all(self._bus, (*commands, *self._frames.torques(permille, self._commands)))
        except (can.CanError, OSError) as error:
            raise self._failed(error) from error
        return np.array(permille) / self._permille_per_nm

    def zero_torque_frames(self) -> list[can.Message]:
        """Frames that take all torque away at once."""
        n = len(self.words)
        self.go(Goal.DISABLED)
        self._commands = [Controlword.DISABLE_VOLTAGE] * n
        commands = [self._frames.command(slot, Controlword.DISABLE_VOLTAGE) for slot in range(n)]
        return [*self._frames.torques([0] * n, self._commands), *filter(None, commands), self._sync]

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

    def _discard_late(self) -> None:
        """Empty the queue before SYNC, so that no frame of the last cycle passes for a new one."""
        for _ in range(_MOST_FRAMES):
            message = self._bus.recv(0.0)
            if message is None:
                return
            slot = self._slots.get(message.arbitration_id)
            if slot is not None and _carries_position(message):
                self._answers.leave_out(slot)
            else:
                self._hear(message)

    def _hear(self, message: can.Message) -> None:
        can_id = message.arbitration_id
        if message.is_error_frame and can_id & _BUS_OFF:
            raise BusStopError(f"bus {self._channel} went bus-off")
        if can_id in self._echoes:
            return
        if can_id in self._slots:
            self.counters.malformed += 1
        elif not (
            is_plain(message)
            and (
                self._supervision.hear(can_id, message.data, self._now_s)
                or self._inputs.hear(can_id, message.data)
            )
        ):
            self.counters.foreign += 1

    def _readings(self, counts: Array) -> Readings:
        if self.words != self._read_words:
            self._read_states()
        enabled, disabled = self._enabled, self._disabled
        fault = self._supervision.fault(self._now_s) or self._state_fault()
        self._arrived |= enabled if self._goal is Goal.ENABLED else disabled
        return Readings(
            self.angle(counts),
            _in_order(self._answers.missing),
            enabled,
            disabled,
            fault,
            self._inputs.reason(),
            _in_order(self._answers.late),
            _in_order(self._answers.duplicates),
            _in_order(self._answers.out_of_order),
        )

    def _read_states(self) -> None:
        self._read_words = self.words.copy()
        self._states = [ds402.state(word) for word in self.words]
        self._enabled = all(s is State.OPERATION_ENABLED for s in self._states)
        self._disabled = not any(s in ds402.ENERGISED for s in self._states)
        self._choose_commands()

    def _choose_commands(self) -> None:
        self._wanted = [ds402.controlword(state, self._goal) for state in self._states]

    def _state_fault(self) -> str | None:
        if self._enabled:
            return None
        must_be_enabled = self._goal is Goal.ENABLED and self._arrived
        for name, state, word in zip(self._names, self._states, self.words, strict=True):
            if state in ds402.FAULTY or (must_be_enabled and state is not State.OPERATION_ENABLED):
                shown = state.words if state is not None else "no state of CiA 402"
                return f"{name} shows {shown} (statusword 0x{word:04X})"
        return None

    @property
    def _now_s(self) -> float:
        return self._count * self._period_s

    def _failed(self, error: Exception) -> BusStopError:
        return BusStopError(f"bus {self._channel} failed ({error})")


def _in_order(slots: set[int]) -> tuple[int, ...]:
    return tuple(sorted(slots)) if slots else ()


def _carries_position(message: can.Message) -> bool:
    return len(message.data) == pdo.POSITION_FRAME.size and is_plain(message)
