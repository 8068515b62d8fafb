"""Master of CANopen torque drives: set-up and shutdown by SDO and NMT around the cycle."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import can
import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile, CanopenDrivesSection
from wamctl.canopen import dictionary as od
from wamctl.canopen import ds402, sdo, set_up
from wamctl.canopen import identifiers as ids
from wamctl.canopen.cycle import Cycle
from wamctl.canopen.ds402 import Goal, State
from wamctl.drives.bus import Channel
from wamctl.drives.every_drive import for_every_drive
from wamctl.drives.interface import Counters, CycleTiming, Readings
from wamctl.errors import BusError

_START, _PRE_OPERATIONAL = 0x01, 0x80


class CanopenDrives:
    """The drives of a configuration on an open bus (interface: `wamctl.drives.interface.Drives`).

    Args:
        bus: the open bus, which nobody else reads.
        arm: the configuration.
        drives: its section of CANopen drives.
        dictionary: the drives' EDS file.
        channel: the bus's name and kind.
    """

    delay_cycles = 1  # torque frames are of type 1: applied at the next SYNC
    enabling_s = 1.0
    enabling_needs = ""
    state_names: Mapping[int, str] = MappingProxyType({int(s): s.words for s in State})

    def __init__(
        self,
        bus: can.BusABC,
        arm: ArmFile,
        drives: CanopenDrivesSection,
        dictionary: Path,
        channel: Channel,
    ) -> None:
        self.names = tuple(f"drive {k} (node {node})" for k, node in enumerate(drives.node_ids, 1))
        self._bus, self._arm, self._drives, self._channel = bus, arm, drives, channel
        self._nodes = [
            sdo.Node(bus, node, od.load_dictionary(dictionary, node)) for node in drives.node_ids
        ]
        self._cycle = Cycle(bus, drives, self.names, channel, arm.bus)

    @property
    def counters(self) -> Counters:
        """Bad frames so far."""
        return self._cycle.counters

    def set_up(self) -> list[str]:
        """Identify, take old faults away, configure; all drives end PRE-OPERATIONAL, no torque.

        Raises:
            DrivesError: every fault of every drive.
        """
        notes: list[str] = []

        def one(slot: int, node: sdo.Node) -> None:
            wanted = set_up.expected(self._arm, self._drives, slot)
            self._command(_PRE_OPERATIONAL, node)
            differences = set_up.identify(node, wanted)
            if differences:
                raise BusError("; ".join(differences))
            old_fault = set_up.reset_fault(node)
            set_up.configure(node, wanted)
            if old_fault:
                notes.append(f"{self.names[slot]} was in fault {old_fault}; it was reset")

        self._for_all(one)
        return notes

    def verify(self) -> None:
        """See whether every drive is still as `set_up` left it, and has not restarted since.

        Raises:
            DrivesError: every difference of every drive.
        """
        self._for_all(
            lambda slot, node: set_up.verify(node, set_up.expected(self._arm, self._drives, slot))
        )

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        return self._cycle.is_own(frame)

    def prepare(self) -> list[str]:
        """As `set_up`: the zero of these drives stands in the configuration."""
        return self.set_up()

    def define(self, angle_motor: Array) -> list[str]:
        """The line of the configuration that makes the motors' angles these, shape (n,) [rad].

        Raises:
            DrivesError: a drive does not answer.
        """
        turn = np.array(self._drives.counts_per_revolution)
        zero = np.rint(self._counts() - angle_motor / (2.0 * np.pi) * turn).astype(int).tolist()
        return [f"write into the section `drives` of the arm's file: zero_counts: {zero}"]

    def resting_angles(self) -> Array:
        """Motor angles by SDO, shape (n,) [rad].

        Raises:
            DrivesError: a drive does not answer.
        """
        return self._cycle.angle(self._counts())

    def _counts(self) -> Array:
        counts = np.zeros(len(self._nodes))

        def one(slot: int, node: sdo.Node) -> None:
            counts[slot] = sdo.read(node, od.POSITION)

        self._for_all(one)
        return counts

    def start(self) -> None:
        """Set the watch on SYNC, go OPERATIONAL, and prime every torque with zero.

        Without the priming, the first SYNC would apply an empty buffer: a controlword of zero.

        Raises:
            DrivesError: a drive refuses the watch.
        """
        self._for_all(lambda _, node: sdo.write(node, od.SYNC_LOSS, self._drives.sync_loss_ms))
        self._for_all(lambda _, node: self._command(_START, node))
        self._cycle.start()
        self._cycle.send(np.zeros(len(self._nodes)))

    def sample(self, timing: CycleTiming) -> Readings:
        """SYNC, then statusword and position of every drive."""
        return self._cycle.sample(timing)

    def send(self, tau_motor: Array, at_once: bool = False) -> Array:
        """Torque frames [N m], shape (n,); returns the torques as rounded on the wire."""
        return self._cycle.send(tau_motor, at_once)

    def enable(self) -> None:
        """Walk to OPERATION ENABLED."""
        self._cycle.go(Goal.ENABLED)

    def disable(self) -> None:
        """Walk to SWITCH ON DISABLED."""
        self._cycle.go(Goal.DISABLED)

    def states(self) -> list[int]:
        """State of each drive, as `ds402.State`; -1 for a statusword that shows none."""
        states = [ds402.state(word) for word in self._cycle.statuswords]
        return [-1 if state is None else int(state) for state in states]

    def cut_off_frames(self) -> list[can.Message]:
        """The frames of `cut_off`, for another process to send; nothing changes here."""
        to_idle = [_order(_PRE_OPERATIONAL, node) for node in self._nodes]
        return [*self._cycle.zero_torque_frames(), *to_idle]

    def cut_off(self) -> None:
        """Zero torque, disable voltage, PRE-OPERATIONAL for all, without looking for answers."""
        self._cycle.go(Goal.DISABLED)
        for frame in self.cut_off_frames():
            try:
                self._bus.send(frame)
            except (can.CanError, OSError):
                continue  # the others may get through; the drives' own watch does the rest

    def _command(self, order: int, node: sdo.Node) -> None:
        try:
            self._bus.send(_order(order, node))
        except (can.CanError, OSError) as error:
            raise BusError(f"its NMT state could not be changed ({error})") from error

    def _for_all(self, step: Callable[[int, sdo.Node], None]) -> None:
        """One step of the set-up for every drive; raises all their faults together."""
        for_every_drive(self.names, lambda k: step(k, self._nodes[k]), self._channel)


def _order(order: int, node: sdo.Node) -> can.Message:
    """An order to a drive's network management (NMT)."""
    data = bytes((order, node.number))
    return can.Message(arbitration_id=ids.NMT, is_extended_id=False, data=data)
