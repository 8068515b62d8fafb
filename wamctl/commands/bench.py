"""How punctual the loop is here, beside what the system can do at best (`wamctl bench`)."""

import ctypes
import re
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from wamctl.arm.control import Setpoint
from wamctl.drives.interface import Counters, Drives
from wamctl.errors import StopError, UsageError
from wamctl.experiment.loop import Array, CheckLevel, Loop
from wamctl.experiment.protocols import bus_plan
from wamctl.experiment.session import Connection, Setup, connected
from wamctl.realtime.latency import Percentiles, percentiles
from wamctl.realtime.scheduling import PRIORITY, Privileges, real_time_scheduling
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.logger import Logger, LogHead, recorded
from wamctl.telemetry.status import Phase

_MONOTONIC, _ABSOLUTE = 1, 1
_CYCLICTEST_MOST_US = 20_000


class _Timespec(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long))


@dataclass(frozen=True)
class Bench:
    """What was measured.

    Attributes:
        seconds: how long the loop ran.
        cycles: how many cycles.
        missed: deadlines that passed unused.
        frames: bad frames.
        latency: wake-up of the loop after its deadline [us].
        cycle: SYNC to last torque frame [us].
        wire_us: part of it that the bus itself takes [us].
        baseline: wake-up of a bare timer in the same minute [us].
        baseline_name: what the bare timer was.
        privileges: what the system granted.
        ratio: latency over the baseline, at 99.9 %.
        software_us: the cycle at 99 %, without the bus's part [us].
        share: of the period that this is.
    """

    seconds: float
    cycles: int
    missed: int
    frames: Counters
    latency: Percentiles
    cycle: Percentiles
    wire_us: float
    baseline: Percentiles
    baseline_name: str
    privileges: Privileges
    ratio: float
    software_us: float
    share: float


def bench(setup: Setup, seconds: float) -> Bench:
    """Run the whole cycle, control law and log included, with disabled drives and zero torque.

    Args:
        setup: which drives.
        seconds: how long; the bare timer runs as long, half of it before and half after.

    Raises:
        UserError: the drives are not there, or the loop was stopped.
    """
    period_s = setup.arm.file.bus.period_s
    with connected(setup) as connection, TemporaryDirectory(prefix="wamctl-") as folder:
        head = _head(setup, connection.drives, Path(folder) / "bench.mcap")
        with (
            recorded(head, waits=False, shown=True) as log,
            real_time_scheduling(real_time=True) as privileges,
        ):
            name, before = baseline(period_s, seconds / 2)
            loop = _run(setup, connection, log, seconds)
            _, after = baseline(period_s, seconds / 2)
    latency, cycle = loop.timing.latency(), loop.timing.cycle()
    timer, wire_us = (
        percentiles(np.concatenate([before, after])),
        bus_plan(setup.arm.file).answer_us,
    )
    software_us = max(0.0, cycle.p99 - wire_us)
    return Bench(
        seconds,
        loop.timing.cycles,
        loop.timing.missed,
        connection.drives.counters,
        latency,
        cycle,
        wire_us,
        timer,
        name,
        privileges,
        latency.p99_9 / max(1e-9, timer.p99_9),
        software_us,
        software_us * 1e-6 / period_s,
    )


def _run(setup: Setup, connection: Connection, log: Logger, seconds: float) -> Loop:
    drives, clock, control = connection.drives, connection.clock, setup.arm.control

    def law(state: ArmState) -> tuple[Setpoint, Array]:
        wanted = Setpoint(state.q, 0.0 * state.q, 0.0 * state.q)
        return wanted, 0.0 * control.torque(state.q, state.qd, wanted)

    loop = Loop(setup.arm, drives, clock, log, lambda: None)
    drives.start()
    clock.start()
    total = loop.cycles(seconds)
    try:
        for k in range(total):
            loop.show(Phase.IDLE, k, total)
            loop.cycle(law, CheckLevel.DRIVES, Phase.IDLE)
    except StopError as stop:
        stop.outcome = "no drive was enabled"
        raise
    return loop


def _head(setup: Setup, drives: Drives, path: Path) -> LogHead:
    joints = setup.arm.robot.joint_names
    return LogHead(path, joints, drives.names, drives.state_names, {}, {})


def baseline(period_s: float, seconds: float) -> tuple[str, Array]:
    """How late a bare timer of the C library wakes, with the scheduling of this process.

    Returns:
        the timer's name, and its latencies, shape (S,) [us].
    """
    if shutil.which("cyclictest"):
        return "cyclictest", _cyclictest(period_s, seconds)
    return "clock_nanosleep", _nanosleep(period_s, seconds)


def _nanosleep(period_s: float, seconds: float) -> Array:
    library, target = ctypes.CDLL(None), _Timespec()
    sleep, where = library.clock_nanosleep, ctypes.byref(target)
    period_ns, count = round(period_s * 1e9), round(seconds / period_s)
    late_us = np.empty(count)
    due = time.monotonic_ns()
    for k in range(count):
        due = max(due + period_ns, time.monotonic_ns())
        target.tv_sec, target.tv_nsec = divmod(due, 1_000_000_000)
        sleep(_MONOTONIC, _ABSOLUTE, where, None)
        late_us[k] = (time.monotonic_ns() - due) * 1e-3
    return late_us


def _cyclictest(period_s: float, seconds: float) -> Array:
    command = ["cyclictest", "-q", "-t1", "-m", f"-p{PRIORITY}", f"-i{round(period_s * 1e6)}"]
    command += [f"-D{max(1, round(seconds))}", f"-h{_CYCLICTEST_MOST_US}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise UsageError(f"cyclictest ended with status {done.returncode}: {done.stderr.strip()}.")
    histogram = re.findall(r"^(\d+)\s+(\d+)$", done.stdout, re.MULTILINE)
    return np.repeat([float(us) for us, _ in histogram], [int(n) for _, n in histogram])
