"""The simulated arm with faults: it stands in the place of the healthy one."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sim_bus.can_bus.frame import ERROR, Frame
from sim_bus.faults.drives import AffectedDrive, begin, disguise, end
from sim_bus.faults.frames import FrameFaults
from sim_bus.faults.script import (
    BusOff,
    Fault,
    Happens,
    Lasts,
    LostZero,
    OnFrames,
    OnSafetyModule,
    PendantPressed,
    SafetyFault,
    WrongIdentity,
    WrongNode,
)
from sim_bus.faults.timeline import Timeline
from sim_bus.node import SyncSchedule
from sim_bus.puck.safety_module import Lamp, Press
from sim_bus.puck.safety_node import SafetyNode
from sim_bus.simulated_arm import SimulatedArm

HOST_IS_BUS_OFF = Frame(ERROR | 0x40, bytes(8))
"""Error frame by which the kernel reports that the host's controller is bus-off."""


class FaultyArm:
    """An arm with faults.

    Args:
        arm: the healthy arm.
        faults: what happens to it.
        affected_drives: its drives by their node id in the fault file.
        schedule: which frames open a cycle.
        seed: of chance.
        tell: takes a sentence about each fault as it begins.
    """

    def __init__(
        self,
        arm: SimulatedArm,
        faults: Sequence[Fault],
        affected_drives: Mapping[int, AffectedDrive],
        schedule: SyncSchedule,
        seed: int,
        tell: Callable[[str], None],
    ) -> None:
        self._arm = arm
        self._affected_drives = affected_drives
        self._schedule = schedule
        self._tell = tell
        self._timeline = Timeline(
            [f for f in faults if not isinstance(f, WrongNode | WrongIdentity)]
        )
        self._to_drives, self._to_host = (
            FrameFaults(np.random.default_rng([seed, way])) for way in (0xA, 0xB)
        )
        self._host_is_off = False
        self._safety = [node for node in arm.nodes if isinstance(node, SafetyNode)]
        for fault in faults:
            if isinstance(fault, WrongIdentity):
                disguise(fault, affected_drives[fault.node].drive)

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on of all nodes."""
        self._timeline.note("power_on", time_ns)
        return self._leave(time_ns, self._arm.boot(time_ns) + self._go_on(time_ns))

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers of all nodes to a frame of a program."""
        opens = self._schedule.opens(frame)
        if opens:
            self._timeline.cycle += 1
            self._timeline.note("first_cycle", time_ns)
        answers = self._go_on(time_ns)
        if not self._host_is_off:
            behind = self._to_drives.overtaken(frame, opens)
            answers += self._heard(time_ns, self._to_drives.passed(time_ns, frame) + behind)
        return self._to_host.overtaken(frame, opens) + self._leave(time_ns, answers)

    def overhear(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers to a frame of one of the nodes, once it has passed."""
        behind = self._to_host.overtaken(frame, opens=False)
        return behind + self._leave(time_ns, self._arm.overhear(time_ns, frame))

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames that are due by a time without any input."""
        frames = self._go_on(time_ns) + self._arm.tick(time_ns)
        frames += self._heard(time_ns, self._to_drives.due(time_ns))
        return self._to_host.due(time_ns) + self._leave(time_ns, frames)

    def run_physics(self, time_ns: int) -> None:
        """Let the arm move until a time, under the torques of the present."""
        self._arm.run_physics(time_ns)

    @property
    def next_ns(self) -> int:
        """When `tick` is due at the earliest."""
        return self._arm.next_ns

    def _heard(self, time_ns: int, frames: list[Frame]) -> list[Frame]:
        answers = [answer for f in frames for answer in self._arm.receive(time_ns, f)]
        if self._arm.is_enabled:
            self._timeline.note("enabled", time_ns)
        return answers

    def _leave(self, time_ns: int, frames: list[Frame]) -> list[Frame]:
        if self._host_is_off:
            for frame in frames:  # the nodes still hear each other
                frames += self._arm.overhear(time_ns, frame)
            return [f for f in frames if f is HOST_IS_BUS_OFF]
        return [passed for f in frames for passed in self._to_host.passed(time_ns, f)]

    def _go_on(self, time_ns: int) -> list[Frame]:
        """Let faults begin and end; the frames that the drives send for it."""
        frames: list[Frame] = []
        for fault in self._timeline.ended(time_ns):
            frames += self._end(fault, time_ns)
        for fault in self._timeline.begun(time_ns):
            self._tell(
                f"{fault.fault} begins at {time_ns * 1e-9:.6f} s, cycle {self._timeline.cycle}: "
                f"{fault.model_dump_json(exclude_none=True)}"
            )
            frames += self._begin(fault, time_ns)
        return frames

    def _begin(self, fault: Happens, time_ns: int) -> list[Frame]:
        if isinstance(fault, OnFrames):
            for way in (self._to_drives, self._to_host):
                way.begin(fault)
            return []
        if isinstance(fault, OnSafetyModule):
            return [f for node in self._safety for f in apply_fault(fault, node, time_ns)]
        if isinstance(fault, BusOff) and fault.node == "host":
            self._host_is_off = True
            return [HOST_IS_BUS_OFF]
        return begin(fault, self._affected_drives[int(fault.node)], time_ns)

    def _end(self, fault: Lasts, time_ns: int) -> list[Frame]:
        if isinstance(fault, BusOff) and fault.node == "host":
            self._host_is_off = False
            return []
        return end(fault, self._affected_drives[int(fault.node)], time_ns)


def apply_fault(fault: OnSafetyModule, node: SafetyNode, time_ns: int) -> list[Frame]:
    """Apply a fault: the frames that the module sends for it."""
    match fault:
        case PendantPressed():
            return node.press(Press[fault.button.upper()], time_ns)
        case SafetyFault():
            return node.fail(Lamp[fault.light.upper()], time_ns)
        case LostZero():
            node.module.lose_zero()
    return []
