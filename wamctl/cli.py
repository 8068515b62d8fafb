"""The command `wamctl`."""

import json
import logging
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from wamctl.arm.errors import UserError
from wamctl.commands.bench import Bench, bench
from wamctl.commands.check import Check, check
from wamctl.commands.excite import confirm_by_name, tests_motors
from wamctl.commands.home import home
from wamctl.commands.monitor import monitor
from wamctl.commands.text_output import print_bench, print_check, print_summary, say
from wamctl.errors import SafetyStopError, UsageError
from wamctl.experiment.excite import ExciteRequest, Summary, excite
from wamctl.experiment.operator_stop import Interrupted, StopRequest
from wamctl.experiment.preflight import load_arm, prepare
from wamctl.experiment.session import Setup
from wamctl.experiment.simulator import shipped_effects
from wamctl.live.watch import PORT, check_installed, live_view

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)

Config = Annotated[str, typer.Option(help="the arm's file, or the name of a shipped one")]
Bus = Annotated[
    str | None, typer.Option(help="sim, or INTERFACE:CHANNEL; unset: the configuration's bus")
]
Trajectory = Annotated[
    Path | None, typer.Option(help="trajectory file; unset: the configuration's")
]
Seed = Annotated[int, typer.Option(min=0, help="which simulated arm, and which chance")]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON")]
Debug = Annotated[bool, typer.Option(help="show where an error came from")]
R = TypeVar("R", Summary, Bench, Check)


@app.callback()
def _main() -> None:
    """Drive a torque-controlled arm over CAN, and log what it does."""


def _list_hidden(given: str | None) -> str | None:
    """Answer `--hidden list` at once, whatever else is given or missing."""
    if given == "list":
        with _reported(debug=False):
            typer.echo(shipped_effects())
        raise typer.Exit
    return given


@app.command("excite")
def _excite(
    config: Config,
    bus: Bus = None,
    trajectory: Trajectory = None,
    lockstep: Annotated[bool, typer.Option(help="simulated time, as fast as possible")] = False,
    out: Annotated[Path | None, typer.Option(help="the log to write")] = None,
    seed: Seed = 0,
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            callback=_list_hidden,
            is_eager=True,
            help="with --bus sim: an effect that the arm carries in secret; list: the shipped ones",
        ),
    ] = None,
    yes_move_the_arm: Annotated[
        str, typer.Option(metavar="NAME", help="the arm's name, instead of typing it")
    ] = "",
    skip_test_motion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="the arm's name: its motors were tested since they were switched on",
        ),
    ] = "",
    live: Annotated[bool, typer.Option("--live", help="serve the run to Foxglove")] = False,
    live_port: Annotated[
        int, typer.Option(min=1, max=65535, help="where --live listens, on this machine only")
    ] = PORT,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Run the experiment: check, enable, test motors, excite, disable, and write the log.

    Example: wamctl excite --config wam7.yaml --bus sim --out log.mcap
    """
    with _reported(debug) as operator:
        if live:
            check_installed()
        prepared = prepare(config, trajectory)
        file = prepared.arm.file
        setup = Setup(prepared.path, prepared.arm, bus or file.bus.channel, lockstep, seed, hidden)
        log = out or Path(f"{file.arm}-{datetime.now():%Y%m%d-%H%M%S}.mcap")
        confirm = partial(confirm_by_name, prepared, yes_move_the_arm)
        live_views = (partial(live_view, port=live_port),) if live else ()
        tests = tests_motors(file.arm, skip_test_motion)
        request = ExciteRequest(prepared, setup, log, confirm, live_views, operator, tests)
        summary = excite(request)
        _print(summary, print_summary, as_json)


@app.command("bench")
def _bench(
    config: Config,
    bus: Bus = None,
    seconds: Annotated[float, typer.Option(min=1.0, help="how long to measure [s]")] = 20.0,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Measure the loop's punctuality beside a bare timer's; the drives stay disabled.

    Example: wamctl bench --config wam7.yaml --bus sim --seconds 10
    """
    with _reported(debug):
        path, arm = load_arm(config)
        measured = bench(Setup(path, arm, bus or arm.file.bus.channel), seconds)
        _print(measured, print_bench, as_json)


@app.command("check")
def _check(
    config: Config,
    bus: Annotated[
        str | None, typer.Option(help="sim, or INTERFACE:CHANNEL; unset: no drive is asked")
    ] = None,
    trajectory: Trajectory = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Say everything that can be said without motion: limits, collisions, bus load, drives.

    Example: wamctl check --config wam7.yaml --bus sim
    """
    with _reported(debug):
        prepared = prepare(config, trajectory)
        setup = Setup(prepared.path, prepared.arm, bus) if bus else None
        _print(check(prepared, setup), print_check, as_json)


@app.command("monitor")
def _monitor(
    config: Config,
    bus: Bus = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="how long [s]; unset: until a key is pressed")
    ] = None,
    debug: Debug = False,
) -> None:
    """Show joints and drives, live; the drives stay disabled.

    Example: wamctl monitor --config wam7.yaml --bus sim
    """
    with _reported(debug):
        path, arm = load_arm(config)
        monitor(Setup(path, arm, bus or arm.file.bus.channel), seconds)


@app.command("home")
def _home(config: Config, bus: Bus = None, debug: Debug = False) -> None:
    """Find the arm's zero: the operator holds it in its home pose; the drives stay disabled.

    Example: wamctl home --config wam7.yaml --bus socketcan:can0
    """
    with _reported(debug):
        path, arm = load_arm(config)
        setup = Setup(path, arm, bus or arm.file.bus.channel)
        for line in home(setup, lambda text: typer.prompt(text, default="", err=True)):
            typer.echo(line)


def _print(result: R, in_words: Callable[[R], None], as_json: bool) -> None:
    if as_json:
        content = result.figures() if isinstance(result, Summary) else asdict(result)
        typer.echo(json.dumps(content, indent=2))
    else:
        in_words(result)


@contextmanager
def _reported(debug: bool) -> Iterator[StopRequest]:
    """End the command with one sentence and its exit code."""
    if not debug:
        logging.getLogger("canopen").addHandler(logging.NullHandler())
        logging.getLogger("canopen").propagate = False
    try:
        with StopRequest().in_command() as operator:
            try:
                yield operator
            except typer.Abort as error:
                say("The operator gave no answer, so that nothing was done.")
                raise typer.Exit(UsageError.exit_code) from error
            except Interrupted as error:
                say(str(error))
                raise typer.Exit(SafetyStopError.exit_code) from error
            except UserError as error:
                if debug:
                    traceback.print_exc()
                say(str(error))
                raise typer.Exit(error.exit_code) from error
    except KeyboardInterrupt as error:  # between the handlers of two stages
        say("The operator stopped it.")
        raise typer.Exit(SafetyStopError.exit_code) from error


def main() -> None:
    """Entry point of the console script."""
    try:
        app()
    except Exception as error:  # noqa: BLE001
        if "--debug" in sys.argv:
            traceback.print_exc()
        say(
            f"wamctl has a bug ({type(error).__name__}: {error}). Run it with --debug and report "
            "the trace."
        )
        sys.exit(1)
