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

from wamctl.arm.command_line import (
    CONTEXT,
    QuietOption,
    Version,
    hidden_names,
    next_step,
    shipped_names,
    without_quiet,
)
from wamctl.arm.errors import UserError
from wamctl.commands.bench import Bench, bench
from wamctl.commands.check import Check, check
from wamctl.commands.excite import confirm_by_name, tests_motors
from wamctl.commands.home import home
from wamctl.commands.investigate import investigated
from wamctl.commands.monitor import monitor
from wamctl.commands.text_output import (
    print_bench,
    print_check,
    print_investigation,
    print_summary,
    say,
)
from wamctl.errors import SafetyStopError, UsageError
from wamctl.experiment.excite import ExciteRequest, Summary, excite
from wamctl.experiment.operator_stop import Interrupted, StopRequest
from wamctl.experiment.preflight import load_arm, prepare
from wamctl.experiment.session import Setup
from wamctl.experiment.simulator import shipped_effects
from wamctl.investigation.investigate import Investigation, what_next
from wamctl.investigation.state import Request
from wamctl.live.watch import PORT, check_installed, live_view

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=CONTEXT,
)

Config = Annotated[
    str,
    typer.Option(help="The arm's file, or a shipped one's name.", autocompletion=shipped_names),
]
Bus = Annotated[
    str | None,
    typer.Option(help="Either sim, or INTERFACE:CHANNEL; default: the bus in the configuration."),
]
Trajectory = Annotated[
    Path | None, typer.Option(help="Trajectory file; default: the one in the configuration.")
]
Seed = Annotated[
    int, typer.Option(min=0, metavar="N", help="Random seed of the simulated arm and its noise.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Debug = Annotated[bool, typer.Option(help="Show the traceback of an error.")]
R = TypeVar("R", Summary, Bench, Check, Investigation)


@app.callback()
def _main(version: Version = False, quiet: QuietOption = False) -> None:
    """Drive a torque-controlled arm over CAN, and log what it does."""


def _list_hidden(given: str | None) -> str | None:
    """Answer `--hidden list` at once, whatever else is given or missing."""
    if given == "list":
        with _reported(debug=False):
            typer.echo(shipped_effects())
        raise typer.Exit
    return given


Hidden = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        callback=_list_hidden,
        autocompletion=hidden_names,
        is_eager=True,
        help="With --bus sim: hide an effect in the simulated arm; list shows the shipped ones.",
    ),
]
Confirmed = Annotated[
    str, typer.Option(metavar="NAME", help="The arm's name, instead of typing it.")
]


@app.command("excite", short_help="Run the experiment and write its log.")
def _excite(
    config: Config,
    bus: Bus = None,
    trajectory: Trajectory = None,
    lockstep: Annotated[bool, typer.Option(help="Simulated time, as fast as possible.")] = False,
    out: Annotated[Path | None, typer.Option(help="The log to write.")] = None,
    seed: Seed = 0,
    hidden: Hidden = None,
    yes_move_the_arm: Confirmed = "",
    skip_test_motion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The arm's name: skip the motor test, if it was done since power-on.",
        ),
    ] = "",
    live: Annotated[bool, typer.Option("--live", help="Show the run live in Foxglove.")] = False,
    live_port: Annotated[
        int,
        typer.Option(min=1, max=65535, metavar="N", help="Port of --live, on this machine only."),
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
        next_step("ident run", log)


@app.command("investigate", short_help="Experiment in rounds until the verdict is final.")
def _investigate(
    config: Config,
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    bus: Bus = None,
    trajectory: Trajectory = None,
    lockstep: Annotated[bool, typer.Option(help="Simulated time, as fast as possible.")] = False,
    seed: Seed = 0,
    hidden: Hidden = None,
    budget: Annotated[
        str, typer.Option(metavar="DURATION", help="Time on the clock, such as 10min.")
    ] = "20min",
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Further bounds: motion_s, energy_j, motor_load, stops, motions, answers.",
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where it has ended.")] = False,
    answer: Annotated[
        str,
        typer.Option(
            metavar="CHANGE",
            help="With --resume: what was done to the arm since: load=KG,X,Y,Z, tilt=X,Y, again.",
        ),
    ] = "",
    live: Annotated[bool, typer.Option("--live", help="Serve each run to Foxglove.")] = False,
    yes_move_the_arm: Confirmed = "",
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Experiment, identify, find the gap and choose the next motion, until the verdict is final.

    Example: wamctl investigate --config wam7.yaml --bus sim --lockstep --out investigation
    """
    with _reported(debug):
        channel = bus or load_arm(config)[1].file.bus.channel
        first = None if trajectory is None else str(trajectory)
        request = Request(config, channel, lockstep, hidden, seed, first)
        options = ["--yes-move-the-arm", yes_move_the_arm] if yes_move_the_arm else []
        options += ["--live"] if live else []
        found = investigated(request, out, (budget, limit or []), resume, options, answer)
        _print(found, print_investigation, as_json)
        next_step(what_next(found.content, out))


@app.command("bench", short_help="Measure the loop's timing, without motion.")
def _bench(
    config: Config,
    bus: Bus = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, metavar="X", help="How long to measure [s].")
    ] = 20.0,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Measure the loop's timing against a bare timer's; the drives stay disabled.

    Example: wamctl bench --config wam7.yaml --bus sim --seconds 10
    """
    with _reported(debug):
        path, arm = load_arm(config)
        measured = bench(Setup(path, arm, bus or arm.file.bus.channel), seconds)
        _print(measured, print_bench, as_json)
        next_step("wamctl check --config", config, "--bus", bus or arm.file.bus.channel)


@app.command("check", short_help="Check all that needs no motion.")
def _check(
    config: Config,
    bus: Annotated[
        str | None,
        typer.Option(help="Either sim, or INTERFACE:CHANNEL; without: ask no drive."),
    ] = None,
    trajectory: Trajectory = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Check all that can be checked without motion: limits, collisions, bus load, drives.

    Example: wamctl check --config wam7.yaml --bus sim
    """
    with _reported(debug):
        prepared = prepare(config, trajectory)
        setup = Setup(prepared.path, prepared.arm, bus) if bus else None
        _print(check(prepared, setup), print_check, as_json)
        chosen = [] if trajectory is None else ["--trajectory", trajectory]
        next_step("wamctl", "excite", "--config", config, *chosen, "--bus", bus or "sim")


@app.command("monitor", short_help="Show joints and drives, live.")
def _monitor(
    config: Config,
    bus: Bus = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="X", help="How long [s]; default: until a key is pressed."),
    ] = None,
    debug: Debug = False,
) -> None:
    """Show joints and drives, live; the drives stay disabled.

    Example: wamctl monitor --config wam7.yaml --bus sim
    """
    with _reported(debug):
        path, arm = load_arm(config)
        monitor(Setup(path, arm, bus or arm.file.bus.channel), seconds)
        next_step("wamctl home --config", config, "--bus", bus or arm.file.bus.channel)


@app.command("home", short_help="Find the arm's zero, held by the operator.")
def _home(config: Config, bus: Bus = None, debug: Debug = False) -> None:
    """Find the arm's zero: the operator holds it in its home pose; the drives stay disabled.

    Example: wamctl home --config wam7.yaml --bus socketcan:can0
    """
    with _reported(debug):
        path, arm = load_arm(config)
        setup = Setup(path, arm, bus or arm.file.bus.channel)
        for line in home(setup, lambda text: typer.prompt(text, default="", err=True)):
            typer.echo(line)
        next_step("wamctl bench --config", config, "--bus", setup.bus)


def _print(result: R, in_words: Callable[[R], None], as_json: bool) -> None:
    if as_json:
        if isinstance(result, Investigation):
            content = result.content
        else:
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
        app(without_quiet(sys.argv[1:]))
    except Exception as error:  # noqa: BLE001 - the last place: a bug ends in a sentence too
        if "--debug" in sys.argv:
            traceback.print_exc()
        say(
            f"wamctl has a bug ({type(error).__name__}: {error}). Run it with --debug and report "
            "the trace."
        )
        sys.exit(1)
