"""Options of the commands, and what they mean."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from wamctl.arm.command_line import hidden_names, shipped_names
from wamctl.commands.reported import reported
from wamctl.experiment.simulator import shipped_effects
from wamctl.live.watch import PORT

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


def _list_hidden(given: str | None) -> str | None:
    """Answer `--hidden list` at once, whatever else is given or missing."""
    if given == "list":
        with reported(debug=False):
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


@dataclass(frozen=True)
class Experiment:
    """Which arm is to move, how, and on which bus."""

    config: Config
    bus: Bus = None
    trajectory: Trajectory = None
    lockstep: Annotated[bool, typer.Option(help="Simulated time, as fast as possible.")] = False
    seed: Seed = 0
    hidden: Hidden = None


@dataclass(frozen=True)
class Operator:
    """What the operator need not be asked."""

    yes_move_the_arm: Confirmed = ""
    skip_test_motion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The arm's name: skip the motor test, if it was done since power-on.",
        ),
    ] = ""


@dataclass(frozen=True)
class Live:
    """Whether and where the run is shown."""

    live: Annotated[bool, typer.Option("--live", help="Show the run live in Foxglove.")] = False
    live_port: Annotated[
        int,
        typer.Option(min=1, max=65535, metavar="N", help="Port of --live, on this machine only."),
    ] = PORT


@dataclass(frozen=True)
class Bounds:
    """What an investigation may cost."""

    budget: Annotated[
        str, typer.Option(metavar="DURATION", help="Time on the clock, such as 10min.")
    ] = "20min"
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Further bounds: motion_s, energy_j, motor_load, stops, motions, answers.",
        ),
    ] = None


@dataclass(frozen=True)
class Resumed:
    """Whether an earlier investigation goes on, and what has happened since."""

    resume: Annotated[bool, typer.Option("--resume", help="Go on where it has ended.")] = False
    answer: Annotated[
        str,
        typer.Option(
            metavar="CHANGE",
            help="With --resume: what was done to the arm since: load=KG,X,Y,Z, tilt=X,Y, again.",
        ),
    ] = ""
