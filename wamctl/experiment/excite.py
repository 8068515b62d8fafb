"""The whole of `wamctl excite`: the pieces put together, and taken apart whatever happens."""

import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path

from wamctl.drives.interface import Counters
from wamctl.errors import StopError, UsageError
from wamctl.experiment import phases as experiment
from wamctl.experiment import provenance
from wamctl.experiment.loop import Arm, Array, Loop
from wamctl.experiment.operator_stop import StopRequest
from wamctl.experiment.preflight import Prepared
from wamctl.experiment.session import Connection, Setup, connected
from wamctl.realtime.latency import Timing
from wamctl.realtime.scheduling import Privileges, real_time_scheduling
from wamctl.safety.watchdog import NOBODY_WATCHES, Heart, silence_s, watched
from wamctl.telemetry.logger import LiveView, LogHead, recorded


@dataclass(frozen=True)
class ExciteRequest:
    """What is wanted.

    Attributes:
        prepared: the checked configuration.
        setup: where its drives are.
        out: the log to write.
        confirm: asks the operator before the drives are enabled; raises when he refuses.
        live_views: viewers that run beside it.
        operator: how the operator stops it.
        tests_motors: test each motor by a small motion first.
    """

    prepared: Prepared
    setup: Setup
    out: Path
    confirm: Callable[[Connection], None]
    live_views: tuple[LiveView, ...] = ()
    operator: StopRequest = field(default_factory=StopRequest)
    tests_motors: bool = True


@dataclass(frozen=True)
class Summary:
    """What came of it.

    Attributes:
        log: the log.
        rows: cycles in it.
        counted: those of the trajectory's counted periods.
        frames: bad frames.
        timing: how punctual the loop was.
        privileges: what the system granted.
        speed: times as fast as real time, in lockstep; None in real time.
    """

    log: Path
    rows: int
    counted: int
    frames: Counters
    timing: Timing
    privileges: Privileges
    speed: float | None

    def figures(self) -> dict[str, object]:
        """The result as plain numbers and words."""
        return {
            "log": str(self.log),
            "cycles": self.rows,
            "counted_cycles": self.counted,
            "missed_deadlines": self.timing.missed,
            "frames": asdict(self.frames),
            "latency_us": asdict(self.timing.latency()),
            "cycle_us": asdict(self.timing.cycle()),
            "scheduling": self.privileges.scheduling,
            "memory_locked": self.privileges.memory_locked,
            "speed": self.speed,
        }


def excite(request: ExciteRequest) -> Summary:
    """Run the experiment and write its log.

    Raises:
        UserError: it could not start, or it ended early; nothing moves any more.
    """
    if request.out.exists():
        raise UsageError(f"The log {request.out} exists already: name another with --out.")
    with connected(request.setup) as connection:
        arm, excitation = request.prepared.arm, request.prepared.excitation
        rest = _rest(arm, connection)
        experiment.plan(arm, rest, excitation)
        request.confirm(connection)
        connection.drives.verify()
        fresh = _rest(arm, connection)
        experiment.check_rest(rest, fresh, arm.robot.joint_names)
        return _run(request, connection, experiment.plan(arm, fresh, excitation))


def _rest(arm: Arm, connection: Connection) -> Array:
    return arm.transmission.joint_angle(connection.drives.resting_angles())


def _run(request: ExciteRequest, connection: Connection, motion: experiment.Motion) -> Summary:
    arm, setup, drives = request.prepared.arm, request.setup, connection.drives
    log = None
    try:
        with (
            recorded(
                _head(request, connection), connection.clock.waits, True, request.live_views
            ) as log,
            request.operator.listening() as operator,
            _watched(connection, arm) as heart,
            real_time_scheduling(real_time=not setup.lockstep) as privileges,
        ):
            loop = Loop(arm, drives, connection.clock, log, operator, heart)
            _start(connection)
            started_s = time.monotonic()
            counted = experiment.run(arm, drives, loop, motion, request.tests_motors)
            took_s = time.monotonic() - started_s
    except StopError as stop:
        if log is not None:
            stop.outcome += f"; {log.summary}"
        raise
    speed = loop.timing.cycles * arm.file.bus.period_s / took_s if setup.lockstep else None
    rows = log.rows_on_disk
    return Summary(request.out, rows, counted, drives.counters, loop.timing, privileges, speed)


def _watched(connection: Connection, arm: Arm) -> AbstractContextManager[Heart]:
    """A heart that another process watches, where time does not wait for the loop."""
    if connection.clock.waits or not connection.channel.has_shared_socket:
        return nullcontext(NOBODY_WATCHES)
    patience_s = silence_s(arm.file.bus.period_s, arm.file.safety.missed_cycles)
    return watched(connection.bus, connection.drives.cut_off_frames(), patience_s)


def _start(connection: Connection) -> None:
    drives = connection.drives
    drives.start()
    if drives.enabling_needs:
        within = f"within {drives.enabling_s:g} s"
        sys.stderr.write(f"Enabling needs {drives.enabling_needs} {within}.\n")
    connection.clock.start()


def _head(request: ExciteRequest, connection: Connection) -> LogHead:
    prepared, setup, drives = request.prepared, request.setup, connection.drives
    return LogHead(
        request.out,
        prepared.arm.robot.joint_names,
        drives.names,
        drives.state_names,
        provenance.metadata(setup, connection.channel),
        provenance.attachments(setup, prepared.trajectory),
    )
