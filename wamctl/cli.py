"""The command `wamctl`."""

import json
import sys
import traceback
from collections.abc import Callable
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
    grouped,
    next_step,
    without_quiet,
)
from wamctl.commands.bench import Bench, bench
from wamctl.commands.check import Check, check
from wamctl.commands.excite import confirm_by_name, tests_motors
from wamctl.commands.home import home
from wamctl.commands.investigate import investigated
from wamctl.commands.monitor import monitor
from wamctl.commands.options import (
    Bounds,
    Bus,
    Config,
    Confirmed,
    Debug,
    Experiment,
    Json,
    Live,
    Operator,
    Resumed,
    Trajectory,
)
from wamctl.commands.reported import reported
from wamctl.commands.text_output import (
    print_bench,
    print_check,
    print_investigation,
    print_summary,
    say,
)
from wamctl.experiment.excite import ExciteRequest, Summary, excite
from wamctl.experiment.preflight import load_arm, prepare
from wamctl.experiment.session import Setup
from wamctl.investigation.investigate import Investigation, what_next
from wamctl.live.watch import check_installed, live_view

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=CONTEXT,
)

R = TypeVar("R", Summary, Bench, Check, Investigation)


@app.callback()
def _main(version: Version = False, quiet: QuietOption = False) -> None:
    """Drive a torque-controlled arm over CAN, and log what it does."""


@app.command("excite", short_help="Run the experiment and write its log.")
@grouped
def _excite(
    given: Experiment,
    allowed: Operator,
    shown: Live,
    out: Annotated[Path | None, typer.Option(help="The log to write.")] = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Run the experiment: check, enable, test motors, excite, disable, and write the log.

    Example: wamctl excite --config wam7.yaml --bus sim --out log.mcap
    """
    with reported(debug) as operator:
        if shown.live:
            check_installed()
        prepared = prepare(given.config, given.trajectory)
        path, arm, file = prepared.path, prepared.arm, prepared.arm.file
        bus = given.bus or file.bus.channel
        setup = Setup(path, arm, bus, given.lockstep, given.seed, given.hidden)
        log = out or Path(f"{file.arm}-{datetime.now():%Y%m%d-%H%M%S}.mcap")
        confirm = partial(confirm_by_name, prepared, allowed.yes_move_the_arm)
        live_views = (partial(live_view, port=shown.live_port),) if shown.live else ()
        tests = tests_motors(file.arm, allowed.skip_test_motion)
        request = ExciteRequest(prepared, setup, log, confirm, live_views, operator, tests)
        summary = excite(request)
        _print(summary, print_summary, as_json)
        next_step("ident run", log)


@app.command("investigate", short_help="Experiment in rounds until the verdict is final.")
@grouped
def _investigate(
    given: Experiment,
    out: Annotated[Path, typer.Option(help="Folder for the results.")],
    bounds: Bounds,
    resumed: Resumed,
    live: Annotated[bool, typer.Option("--live", help="Serve each run to Foxglove.")] = False,
    yes_move_the_arm: Confirmed = "",
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Experiment, identify, find the gap and choose the next motion, until the verdict is final.

    Example: wamctl investigate --config wam7.yaml --bus sim --lockstep --out investigation
    """
    with reported(debug):
        options = ["--yes-move-the-arm", yes_move_the_arm] if yes_move_the_arm else []
        options += ["--live"] if live else []
        found = investigated(given, out, bounds, resumed, options)
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
    with reported(debug):
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
    with reported(debug):
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
    with reported(debug):
        path, arm = load_arm(config)
        monitor(Setup(path, arm, bus or arm.file.bus.channel), seconds)
        next_step("wamctl home --config", config, "--bus", bus or arm.file.bus.channel)


@app.command("home", short_help="Find the arm's zero, held by the operator.")
def _home(config: Config, bus: Bus = None, debug: Debug = False) -> None:
    """Find the arm's zero: the operator holds it in its home pose; the drives stay disabled.

    Example: wamctl home --config wam7.yaml --bus socketcan:can0
    """
    with reported(debug):
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
