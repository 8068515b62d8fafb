"""The command `sim-bus`."""

import contextlib
import ctypes
import gc
import json
import os
import signal
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from sim_bus.assembly import Simulation, load_simulation
from sim_bus.can_bus.frame_length import warm_up
from sim_bus.can_bus.hub import Hub
from sim_bus.can_bus.hubs import open_hub
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.hidden_effects.catalogue import hidden_file, shipped_summaries
from sim_bus.plant.truth import write_truth
from sim_bus.server import Arm, Lockstep, RealTime, Service, serve
from wamctl.arm.command_line import (
    CONTEXT,
    QuietOption,
    Version,
    grouped,
    hidden_names,
    shipped_names,
    without_quiet,
)
from wamctl.arm.compilation import compilation_announced
from wamctl.arm.errors import UserError

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=CONTEXT,
)

_PRIORITY = 40
_LOCK_CURRENT, _LOCK_FUTURE = 1, 2


class _Stopped(BaseException):
    """The operator or the parent process asks to end."""


@app.callback()
def _main(version: Version = False, quiet: QuietOption = False) -> None:
    """Simulated drives and arm on a CAN bus."""


@dataclass(frozen=True)
class Simulated:
    """Which arm is simulated, and what is wrong with it."""

    config: Annotated[
        str,
        typer.Option(help="The arm's file, or a shipped one's name.", autocompletion=shipped_names),
    ]
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Random seed of the arm and its noise.")
    ] = 0
    faults: Annotated[Path | None, typer.Option(help="Fault file: what goes wrong, and when.")] = (
        None
    )
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Hide an effect in the arm; `sim-bus hidden` lists them.",
            autocompletion=hidden_names,
        ),
    ] = None


@app.command("serve")
@grouped
def _serve(
    given: Simulated,
    bus: Annotated[str, typer.Option(help="simbus:PATH, or INTERFACE:CHANNEL of python-can.")],
    lockstep: Annotated[
        bool, typer.Option(help="Simulated time: one period of physics per SYNC.")
    ] = False,
    truth: Annotated[
        Path | None, typer.Option(help="Write the arm's true parameters here.")
    ] = None,
    stop_with_stdin: Annotated[bool, typer.Option(help="Stop when standard input closes.")] = False,
    debug: Annotated[bool, typer.Option(help="Show the traceback of an error.")] = False,
) -> None:
    """Serve the drives and the arm until SIGINT or SIGTERM.

    Example: sim-bus serve --config wam7.yaml --bus udp_multicast:239.74.163.2
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    try:
        with compilation_announced("the simulated arm"):
            simulation, arm = _load(given)
            simulation.arm.plant.warm_up()
            warm_up(simulation.timing)
        if truth is not None:
            write_truth(truth, simulation.truth)
        hub = open_hub(bus, simulation.is_fd)
        try:
            service, clock = _clock(simulation, arm, hub, lockstep)
            drives = len(simulation.arm.motors)
            _say(f"sim-bus is ready on {bus}: {drives} drives, seed {given.seed}, {clock}.")
            _serve_without_pauses(service, hub, stop_with_stdin)
        finally:
            hub.close()
    except _Stopped:
        return
    except UserError as error:
        if debug:
            traceback.print_exc()
        typer.echo(str(error), err=True)
        raise typer.Exit(error.exit_code) from error


@app.command("hidden")
def _hidden(
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """List the effects that `serve --hidden` knows.

    Example: sim-bus hidden
    """
    summaries = shipped_summaries()
    if as_json:
        typer.echo(json.dumps(summaries, indent=2))
        return
    width = max(map(len, summaries))
    for name, summary in summaries.items():
        typer.echo(f"{name:{width}}  {summary}")


def _load(given: Simulated) -> tuple[Simulation, Arm]:
    effects = None if given.hidden is None else hidden_file(given.hidden)
    if given.faults is None:
        simulation = load_simulation(given.config, given.seed, effects)
        return simulation, simulation.arm
    return load_faulty_simulation(given.config, given.seed, given.faults, _say, effects)


def _clock(simulation: Simulation, arm: Arm, hub: Hub, lockstep: bool) -> tuple[Service, str]:
    if lockstep:
        return Lockstep(arm, hub, simulation.period_ns, simulation.schedule), "lockstep"
    return RealTime(arm, hub, simulation.timing), f"real time, {_raise_priority()}"


def _raise_priority() -> str:
    """Real-time scheduling and locked memory where the system permits it; says what it got."""
    locked = ctypes.CDLL(None).mlockall(_LOCK_CURRENT | _LOCK_FUTURE) == 0
    memory = "memory locked" if locked else "memory not locked"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except PermissionError:
        return f"ordinary scheduling, {memory}"
    return f"SCHED_FIFO {_PRIORITY}, {memory}"


def _serve_without_pauses(service: Service, hub: Hub, stop_with_stdin: bool) -> None:
    gc.freeze()
    gc.disable()  # nothing in the loop makes cycles of references
    try:
        serve(service, hub, sys.stdin if stop_with_stdin else None)
    finally:
        gc.enable()
        if isinstance(service, RealTime):
            end = (
                f"The bus carried {service.load.frames} frames; "
                f"its load was {100.0 * service.load.peak:.0f} % in the busiest second.\n"
            )
            with contextlib.suppress(OSError):  # nobody may be listening any more
                os.write(sys.stdout.fileno(), end.encode())


def _say(sentence: str) -> None:
    typer.echo(sentence)
    sys.stdout.flush()


def _stop(number: int, frame: FrameType | None) -> None:
    raise _Stopped


def main() -> None:
    """Entry point of the console script."""
    app(without_quiet(sys.argv[1:]))
