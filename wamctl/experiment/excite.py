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
from wamctl.experiment.session import Connection, Place, connected
from wamctl.realtime.latency import Timing
from wamctl.realtime.scheduling import Grants, punctual
from wamctl.telemetry.logger import LogHead, Watcher, recorded


@dataclass(frozen=True)
class Order:
    """What is wanted.

    Attributes:
        prepared: the checked configuration.
        place: where its drives are.
        out: the log to write.
        confirm: asks the operator before the drives are enabled; raises when he refuses.
        watchers: who looks on.
    """

    prepared: Prepared
    place: Place
    out: Path
    confirm: Callable[[Connection], None]
    watchers: tuple[Watcher, ...] = ()


@dataclass(frozen=True)
class Summary:
    """What came of it.

    Attributes:
        log: the log.
        rows: cycles in it.
        counted: those of the trajectory's counted periods.
        frames: bad frames.
        timing: how punctual the loop was.
        grants: what the system granted.
        speed: times as fast as real time, in lockstep; None in real time.
    """

    log: Path
    rows: int
    counted: int
    frames: Counters
    timing: Timing
    grants: Grants
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
            "scheduling": self.grants.scheduling,
            "memory_locked": self.grants.memory_locked,
            "speed": self.speed,
        }


def excite(order: Order) -> Summary:
    """Run the experiment and write its log.

    Raises:
        UserError: it could not start, or it ended early; nothing moves any more.
    """
    if order.out.exists():
        raise UsageError(f"The log {order.out} exists already: name another with --out.")
    arm, place = order.prepared.arm, order.place
    with connected(place) as connection:
        clock, drives = connection.clock, connection.drives
        rest = arm.transmission.joint_angle(drives.resting_angles())
        motion = experiment.plan(arm, rest, order.prepared.excitation)
        order.confirm(connection)
        with (
            recorded(_head(order, connection), clock.waits, True, order.watchers) as log,
            StopRequest().listening() as operator,
            punctual(real_time=not place.lockstep) as grants,
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
                stop.outcome += f"; the log {order.out} holds {log.rows} cycles"
                raise
            took_s = time.monotonic() - started_s
    speed = loop.timing.cycles * arm.file.bus.period_s / took_s if place.lockstep else None
    return Summary(order.out, log.rows, counted, drives.counters, loop.timing, grants, speed)


def _head(order: Order, connection: Connection) -> LogHead:
    prepared, place, drives = order.prepared, order.place, connection.drives
    return LogHead(
        order.out,
        prepared.arm.robot.joint_names,
        drives.names,
        drives.state_names,
        provenance.metadata(place, connection.channel),
        provenance.attachments(place, prepared.trajectory),
    )
