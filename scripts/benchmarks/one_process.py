"""An experiment on the simulated bus in one process, and runs that share their beginning.

Master, bus, drives and arm take turns in one thread: no socket, no server, no writer. So the
process can be forked at any cycle: what lies behind is paid for once, and each case goes on from
there. Times are those of the simulated arm; torques and states those of its drives.
"""

import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import can
import numpy as np
from fault_witness import Witness
from numpy.typing import NDArray

from sim_bus.assembly import Simulation
from sim_bus.can_bus.frame import ERROR, EXTENDED, REMOTE, Frame
from sim_bus.can_bus.hub import Received
from sim_bus.server import Lockstep
from wamctl.drives.bus import Channel
from wamctl.drives.interface import Drives
from wamctl.experiment import phases as experiment
from wamctl.experiment.loop import Loop
from wamctl.experiment.preflight import Prepared
from wamctl.experiment.protocols import open_drives
from wamctl.realtime.clock import LockstepClock

Array = NDArray[np.floating]

_WAITING_S = 0.001
"""Longer waits are those of the set-up, whose answers another thread may give."""


class DirectBus(can.BusABC):
    """A bus to the simulated arm that is a call: the answers are there when `send` returns.

    Args:
        simulation: its period and schedule.
        arm: drives and physics.

    Attributes:
        before_cycle: called before each frame that opens a cycle.
    """

    gathers = False

    def __init__(self, simulation: Simulation, arm: Witness) -> None:
        super().__init__(channel="direct")
        self.before_cycle: Callable[[], None] = lambda: None
        self._opens = simulation.schedule.opens
        self._arrived: SimpleQueue[can.Message] = SimpleQueue()
        self._now_ns = 0
        self._lockstep = Lockstep(arm, self, simulation.period_ns, simulation.schedule)
        self._lockstep.start()

    @property
    def now_s(self) -> float | None:
        """The arm's time [s]."""
        return self._now_ns * 1e-9

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """A frame, and all that follows from it."""
        flags = msg.is_extended_id * EXTENDED | msg.is_remote_frame * REMOTE
        frame = Frame(msg.arbitration_id | flags, bytes(msg.data or b""), msg.is_fd)
        if self._opens(frame):
            self.before_cycle()
        self._lockstep.take(Received(frame, self, None))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame; None where there is none."""
        try:
            if timeout is not None and timeout < _WAITING_S:
                return self._arrived.get_nowait()
            return self._arrived.get(timeout=timeout)
        except Empty:
            return None

    def deliver(self, frames: list[Frame], sender: object, time_ns: int) -> None:
        """Frames of the arm's devices."""
        if sender is self:
            return
        for can_id, data, fd, passed_ns in frames:
            extended = bool(can_id & EXTENDED)
            message = can.Message(
                (passed_ns or time_ns) * 1e-9,
                can_id & (0x1FFF_FFFF if extended else 0x7FF),
                is_extended_id=extended,
                is_error_frame=bool(can_id & ERROR),
                data=data,
                is_fd=fd,
            )
            self._arrived.put(message)

    def settle(self, sender: object, time_ns: int) -> None:
        """All that follows from a frame is there."""
        self._now_ns = time_ns

    def flush(self) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Nothing to close."""

    def sources(self) -> list[int]:
        """Nothing to select."""
        return []

    def receive(self, readable: object) -> list[Received]:
        """Frames come by `send`."""
        return []


@dataclass
class MemoryLog:
    """A log in memory.

    Attributes:
        stamps_ns: of the rows.
    """

    stamps_ns: list[int] = field(default_factory=list)

    @property
    def rows(self) -> int:
        """Cycles in it."""
        return len(self.stamps_ns)

    def cycle(self, stamp_ns: int, *columns: object) -> None:
        """One row."""
        self.stamps_ns.append(stamp_ns)

    def status(self, *status: object) -> None:
        """Nobody reads it."""

    def progress(self, *progress: object) -> None:
        """Nobody looks."""


@dataclass(frozen=True)
class Rig:
    """An experiment whose drives are set up and started.

    Attributes:
        prepared: the checked configuration.
        bus: where it happens.
        drives: the drives as the master has them.
        loop: the loop.
        log: the log.
        motion: what the arm is to do.
    """

    prepared: Prepared
    bus: DirectBus
    drives: Drives
    loop: Loop
    log: MemoryLog
    motion: experiment.Motion

    def run(self) -> None:
        """The experiment, with the test of the motors.

        Raises:
            StopError: it ended early.
        """
        experiment.run(self.prepared.arm, self.drives, self.loop, self.motion)


@contextmanager
def set_up(prepared: Prepared, config: Path, simulation: Simulation, arm: Witness) -> Iterator[Rig]:
    """An experiment on an arm, ready to run; its drives are cut off in the end."""
    file, period_s = prepared.arm.file, prepared.arm.file.bus.period_s
    bus = DirectBus(simulation, arm)
    drives = open_drives(bus, Channel("simbus", "direct"), file, config, lockstep=True)
    try:
        drives.set_up()
        rest = prepared.arm.transmission.joint_angle(drives.resting_angles())
        motion = experiment.plan(prepared.arm, rest, prepared.excitation)
        clock, log = LockstepClock(period_s, bus), MemoryLog()
        loop = Loop(prepared.arm, drives, clock, log, lambda: None)  # pyright: ignore
        drives.start()
        clock.start()
        yield Rig(prepared, bus, drives, loop, log, motion)
    finally:
        drives.cut_off()
        bus.shutdown()


class Branches:
    """The cases of one run: each is a fork of the process, which goes on where it was made.

    `with Branches() as cases:` around the run; within it, `cases.branch(name)` returns true in the
    new process, once for each call, and false in the old one when the new one has ended. The run
    gives its result to `cases.end`.

    Attributes:
        results: what the cases gave, by name; an exception's words where a case ended with a bug.
    """

    def __init__(self) -> None:
        self.results: list[tuple[Any, Any]] = []
        self._answer: int | None = None

    def branch(self, name: object) -> bool:
        """Begin a case; see above."""
        reading, writing = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(reading)
            self.results, self._answer = [], writing
            return True
        os.close(writing)
        with os.fdopen(reading, "rb") as pipe:
            answer = pipe.read()
        os.waitpid(pid, 0)
        self.results.append((name, pickle.loads(answer) if answer else "the process died"))
        return False

    def end(self, result: object) -> None:
        """The result of a case, which ends its process; nothing in the first one."""
        if self._answer is not None:
            with os.fdopen(self._answer, "wb") as pipe:
                pickle.dump(result, pipe)
            os._exit(0)

    @property
    def is_case(self) -> bool:
        """Whether this process is one of the cases."""
        return self._answer is not None

    def __enter__(self) -> "Branches":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: object) -> None:
        if error is not None:
            self.end(f"{type(error).__name__}: {error}")
