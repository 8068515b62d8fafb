"""Master of classic Pucks: set-up on the quiet bus, start, shutdown, and the arm's zero."""

import time
from collections.abc import Callable, Mapping
from types import MappingProxyType

import can
import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.config import ArmFile, PuckDrivesSection
from wamctl.drives.answers import Answers
from wamctl.drives.bus import Channel
from wamctl.drives.every_drive import for_every_drive
from wamctl.drives.interface import Counters, CycleTiming, Readings
from wamctl.errors import BusError, DrivesError
from wamctl.puck import safety_module, set_up
from wamctl.puck.cycle import Cycle
from wamctl.puck.effective_torque import EffectiveTorque
from wamctl.puck.enumerations import MotorMode
from wamctl.puck.exchange import Exchange
from wamctl.puck.properties import motor_properties, safety_properties
from wamctl.puck.supervision import Supervision
from wamctl.puck.wiring import cycle_frames

NOT_ASKED = -1


class PuckDrives:
    """The Pucks of a configuration on an open bus (interface: `wamctl.drives.interface.Drives`).

    Args:
        bus: the open bus, which nobody else reads.
        arm: the configuration.
        drives: its section of classic Pucks.
        channel: the bus's name and kind.
        lockstep: the simulated arm's time stands still while this program computes.
    """

    delay_cycles = 0  # torque acts on arrival; `send` returns the mean of the old and the new
    enabling_needs = "Shift-Activate on the pendant"
    state_names: Mapping[int, str] = MappingProxyType(
        {NOT_ASKED: "not asked", **{int(mode): mode.name for mode in MotorMode}}
    )

    def __init__(
        self,
        bus: can.BusABC,
        arm: ArmFile,
        drives: PuckDrivesSection,
        channel: Channel,
        lockstep: bool,
    ) -> None:
        nodes, module = drives.node_ids, drives.safety_module
        self.enabling_s = module.activation_s
        self.names = tuple(f"Puck {k} (node {node})" for k, node in enumerate(nodes, 1))
        self._bus, self._drives, self._channel = bus, drives, channel
        self._exchange = Exchange(bus)
        self._module_name = f"safety module (node {module.node_id})"
        self._wanted = [set_up.expected(arm, drives, slot) for slot in range(len(nodes))]
        self._motors = [motor_properties(version) for version in drives.firmware]
        self._safety = safety_properties(module.firmware)
        self._supervision = Supervision(
            nodes,
            self.names,
            self._motors,
            module.node_id,
            self._safety,
            drives.temperature_limit_c,
        )
        period_s, wires = arm.bus.period_s, cycle_frames(drives, self._motors[0], self._safety)
        self._cycle = Cycle(
            bus,
            channel,
            drives,
            wires,
            self._supervision,
            EffectiveTorque(len(nodes), period_s, lockstep),
            Answers(self.names, list(wires.slot_of), period_s),
        )

    @property
    def counters(self) -> Counters:
        """Bad frames so far."""
        return self._cycle.counters

    def set_up(self) -> list[str]:
        """Wake, identify, configure, idle; refuse an arm without a zero.

        Raises:
            DrivesError: every fault of every Puck.
        """
        notes = self.prepare()
        self._for_module(safety_module.check_zero)
        return notes

    def prepare(self) -> list[str]:
        """Wake, identify, configure, idle; returns notes for the operator.

        Raises:
            DrivesError: every fault of every Puck.
        """
        self._check_numbering()
        self._for_module(safety_module.identify)
        found = self._exchange.census(set_up.PROBE_GAP_S, set_up.PROBE_PATIENCE_S)
        notes = self._strangers(found)
        notes += self._wake()

        def one(slot: int) -> None:
            properties = set_up.identify(self._exchange, self._wanted[slot])
            set_up.configure(self._exchange, self._wanted[slot], properties)

        self._for_motors(one)
        warning = self._for_module(safety_module.configure)
        return [*notes, *([warning] if warning else [])]

    def verify(self) -> None:
        """See whether every Puck is still as `set_up` left it, and has not restarted since.

        Raises:
            DrivesError: every difference of every Puck.
        """
        self._for_motors(
            lambda slot: set_up.verify(self._exchange, self._wanted[slot], self._motors[slot])
        )
        self._for_module(safety_module.verify)

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        return self._cycle.is_own(frame)

    def resting_angles(self) -> Array:
        """Motor angles, one Puck after the other, shape (n,) [rad].

        Raises:
            DrivesError: a Puck does not answer.
        """
        counts = np.zeros(len(self.names))

        def one(slot: int) -> None:
            node, number = self._wanted[slot].node, self._motors[slot]["P"]
            counts[slot] = self._exchange.position(node, number)[0]

        self._for_motors(one)
        return self._cycle.angle(counts)

    def define(self, angle_motor: Array) -> list[str]:
        """Declare where the motors are now, shape (n,) [rad], and that the arm has a zero.

        Nothing remains to be done by the operator.

        Raises:
            DrivesError: a Puck or the safety module does not take it.
        """

        def one(slot: int) -> None:
            node, number = self._wanted[slot].node, self._motors[slot]["P"]
            counts = round(angle_motor[slot] / (2.0 * np.pi) * self._wanted[slot].counts)
            self._exchange.tell(node, number, counts)
            found = self._exchange.position(node, number)[0]
            if abs(found - counts) > set_up.ZERO_TOLERANCE_COUNTS:
                raise BusError(f"says position {found} after it was set to {counts} [counts]")

        self._for_motors(one)
        self._for_module(safety_module.declare_zero)
        return []

    def start(self) -> None:
        """Let the safety module ignore the first velocities; torques begin with `enable`."""
        time.sleep(safety_module.GAP_S)
        module, ignored = self._drives.safety_module.node_id, safety_module.IGNORED_SAMPLES
        self._exchange.tell(module, self._safety["IFAULT"], ignored)

    def sample(self, timing: CycleTiming) -> Readings:
        """Poll, then the position of every motor."""
        return self._cycle.sample(timing)

    def send(self, tau_motor: Array, at_once: bool = False) -> Array:
        """Torque frames [N m], shape (n,), which act on arrival in any case.

        Returns the mean torque until the next poll.
        """
        return self._cycle.send(tau_motor)

    def enable(self) -> None:
        """Wait for Shift-Activate: only the pendant can give torque."""
        self._cycle.go(wants_torque=True)

    def disable(self) -> None:
        """Lower the safety module and all Pucks to IDLE."""
        self._cycle.go(wants_torque=False)

    def states(self) -> list[int]:
        """MODE of each motor Puck, as far as it was asked for."""
        return [NOT_ASKED if mode is None else mode for mode in self._supervision.modes]

    def cut_off_frames(self) -> list[can.Message]:
        """The frames of `cut_off`, for another process to send; nothing changes here."""
        return self._cycle.zero_torque_frames()

    def cut_off(self) -> None:
        """Zero torque and IDLE for all, without looking for answers."""
        for frame in self.cut_off_frames():
            try:
                self._bus.send(frame)
            except (can.CanError, OSError):
                continue  # the others may get through; silence is a heartbeat fault anyway

    def _check_numbering(self) -> None:
        """One frame polls all Pucks, and one sets four torques: all must number P and T alike."""
        if len({(p["P"], p["T"]) for p in self._motors}) > 1:
            versions = ", ".join(map(str, sorted({p.version for p in self._motors})))
            fault = (
                f"the Pucks have firmware {versions}, which number P or T differently, so that no "
                "single frame reaches all of them: update the older ones"
            )
            raise DrivesError(str(self._channel), [fault])

    def _strangers(self, found: set[int]) -> list[str]:
        others = found - {*self._drives.node_ids, self._drives.safety_module.node_id}
        if not others:
            return []
        listed = ", ".join(map(str, sorted(others)))
        return [f"other Pucks are on the bus and are left alone (nodes {listed})"]

    def _wake(self) -> list[str]:
        sleeping: list[int] = []
        nodes = [wanted.node for wanted in self._wanted]
        self._for_motors(lambda k: sleeping.extend(set_up.asleep(self._exchange, [nodes[k]])))
        set_up.wake(self._exchange, sleeping)
        listed = ", ".join(map(str, sleeping))
        return [f"Pucks in their monitor were woken (nodes {listed})"] if sleeping else []

    def _for_motors(self, step: Callable[[int], None]) -> None:
        """One step for every motor Puck; raises all their faults together."""
        for_every_drive(self.names, step, self._channel, between=" ")

    def _for_module(self, step: safety_module.Step) -> str:
        try:
            return step(self._exchange, self._drives.safety_module, self._safety)
        except BusError as error:
            raise DrivesError(str(self._channel), [f"{self._module_name} {error}"]) from error
