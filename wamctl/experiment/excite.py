"""The whole of `wamctl excite`: the pieces put together, and taken apart whatever happens."""

import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from wamctl.drives.interface import Counters
from wamctl.errors import StopError, UsageError
from wamctl.experiment import phases as experiment
from wamctl.experiment import provenance
from wamctl.experiment.loop import Loop
from wamctl.experiment.operator_stop import StopRequest
from wamctl.experiment.preflight import Prepared
from wamctl.experiment.session import Connection, Setup, connected
from wamctl.realtime.latency import Timing
from wamctl.realtime.scheduling import Privileges, real_time_scheduling
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
    """

    prepared: Prepared
    setup: Setup
    out: Path
    confirm: Callable[[Connection], None]
    live_views: tuple[LiveView, ...] = ()


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
    arm, setup = request.prepared.arm, request.setup
    with connected(setup) as connection:
        clock, drives = connection.clock, connection.drives
        rest = arm.transmission.joint_angle(drives.resting_angles())
        motion = experiment.plan(arm, rest, request.prepared.excitation)
        request.confirm(connection)
        with (
            recorded(_head(request, connection), clock.waits, True, request.live_views) as log,
            StopRequest().listening() as operator,
            real_time_scheduling(real_time=not setup.lockstep) as privileges,
        ):
            loop = Loop(arm, drives, clock, log, operator)
            drives.start()
            if drives.enabling_needs:
                within = f"within {drives.enabling_s:g} s"
                sys.stderr.write(f"Enabling needs {drives.enabling_needs} {within}.\n")
            clock.start()
            started_s = time.monotonic()
            try:
                counted = experiment.run(arm, drives, loop, motion)
            except StopError as stop:
                stop.outcome += f"; the log {request.out} holds {log.rows} cycles"
                raise
            took_s = time.monotonic() - started_s
    speed = loop.timing.cycles * arm.file.bus.period_s / took_s if setup.lockstep else None
    return Summary(request.out, log.rows, counted, drives.counters, loop.timing, privileges, speed)


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
