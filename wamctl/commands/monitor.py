"""Live table of joints and drives, without torque (`wamctl monitor`)."""

import time
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from wamctl.drives.interface import Drives, Readings
from wamctl.experiment.operator_stop import StopRequest
from wamctl.experiment.session import Connection, Setup, connected
from wamctl.realtime.clock import RealTimeClock
from wamctl.safety.state_estimator import ArmState, StateEstimator

_PERIOD_S = 0.02  # the least that BusSection.period_s allows, too: slow enough to draw in between
_DRAWN = 5  # cycles to a drawing


def monitor(setup: Setup, seconds: float | None) -> None:
    """Show the arm until a key, Ctrl-C, or the time is up; the drives stay disabled.

    Args:
        setup: which arm.
        seconds: how long; None until the operator ends it [s].

    Raises:
        UserError: the drives do not answer, or are others.
    """
    console = Console()
    with connected(setup) as connection, StopRequest().listening() as operator:
        deadline = None if seconds is None else time.monotonic() + seconds
        with Live(console=console, auto_refresh=False) as live:
            for k, (state, readings) in enumerate(_states(setup, connection)):
                if k % _DRAWN == 0:
                    live.update(_table(setup, connection.drives, state, readings), refresh=True)
                if operator() is not None or (deadline and time.monotonic() > deadline):
                    return


def _states(setup: Setup, connection: Connection) -> Iterator[tuple[ArmState, Readings]]:
    drives, arm = connection.drives, setup.arm
    clock = RealTimeClock(_PERIOD_S, connection.channel.stamps_by_wall_clock)
    estimator = StateEstimator(
        arm.transmission, arm.file.controller.velocity_cutoff_hz, drives.resting_angles()
    )
    drives.start()
    clock.start()
    while True:
        clock.tick()
        readings = drives.sample(clock)
        yield estimator.update(readings, _PERIOD_S), readings
        drives.send(np.zeros(arm.robot.dof))


def _table(setup: Setup, drives: Drives, state: ArmState, readings: Readings) -> Table:
    lost = drives.counters.lost
    table = Table(
        box=None,  # fits a terminal of 80 columns
        padding=(0, 2, 0, 0),
        title=Text(f"{setup.arm.file.arm}: {readings.fault or readings.stop or 'no fault'}"),
        caption=f"{lost} positions lost. Drives are disabled. Any key ends.",
    )
    for column in ("joint", "q [rad]", "[deg]", "[rad/s]", "drive", "state"):
        right = "right" if "[" in column else "left"
        table.add_column(Text(column), justify=right, no_wrap=True)
    rows = zip(setup.arm.robot.joint_names, state.q, state.qd, drives.states(), strict=True)
    for slot, (joint, q, qd, code) in enumerate(rows):
        word = drives.state_names.get(code, f"unknown state {code}")
        shown = "silent" if slot in readings.missing else word
        numbers = (f"{q:+.4f}", f"{np.degrees(q):+.2f}", f"{qd:+.3f}")
        table.add_row(*map(Text, (joint, *numbers, str(slot + 1), shown)))
    return table
