"""`ident watch`: tells when a trusted model no longer explains an arm, as it happens."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import JointStates, Json, TorqueChoice
from wamctl.arm.command_line import grouped, next_step

_CHANGED = 6
_MOST_NAMED = 2


@dataclass(frozen=True)
class Alarms:
    """How many false alarms are borne, and when the watch ends."""

    once: Annotated[bool, typer.Option("--once", help="End with the first alarm.")] = False
    false_alarms: Annotated[
        float,
        typer.Option(
            min=1e-6, max=3600.0, metavar="X", help="False alarms to expect in an hour of motion."
        ),
    ] = 0.01
    idle: Annotated[
        float,
        typer.Option(
            min=0.0, metavar="SECONDS", help="A log that has not grown for this long has ended."
        ),
    ] = 10.0


@grouped
def watch(
    source: Annotated[
        str, typer.Argument(help="An MCAP log that may still grow, - for standard input, or ws://.")
    ],
    model: Annotated[Path, typer.Option(help="The trusted model.yaml of `ident run`.")],
    *,
    alarms: Alarms,
    report: Annotated[Path | None, typer.Option(help="Write the alarms as a page, .html.")] = None,
    torque: TorqueChoice = None,
    joint_states: JointStates = "/joint_states",
    as_json: Json = False,
) -> None:
    """Tell within seconds of motion when a trusted model no longer explains the arm, and why.

    Each alarm is a line, with --json one of JSON; exits with 6 if there was any.

    Example: ident watch log.mcap --model identified/model.yaml
    """
    from ident.recordings.loading import Reading
    from ident.watch.settings import DEFAULT
    from ident.workflows.fleet.watch import watched

    reading = Reading(joint_states, torque=torque.value if torque else None)
    settings = replace(DEFAULT, false_alarms_per_hour=alarms.false_alarms)
    told = 0
    for content in watched(source, model, reading, alarms.idle, settings, report):
        typer.echo(json.dumps(content) if as_json else _said(content))
        told += content["kind"] != "end"
        if told and alarms.once:
            break
    if told:
        next_step("ident gap", source if Path(source).is_file() else "LOG.mcap", "--model", model)
        raise typer.Exit(_CHANGED)


def _said(content: dict[str, Any]) -> str:
    """A line in print."""
    if content["kind"] == "end":
        count = content["alarms"] or "no"
        return f"Watched {content['motion_s']:.0f} s of motion: {count} alarms."
    sizes = sorted(
        content["parameters"].items(), key=lambda item: -abs(item[1]["value"] / item[1]["sd"])
    )
    first = [item for item in content["parameters"].items() if item[0] == "mass"] or sizes
    named = ", ".join(
        f"{name} {p['value']:+.3g} ± {p['sd']:.1g} {p['unit']}" for name, p in first[:_MOST_NAMED]
    )
    where = f" at joint {content['joints'][0]}" if content["joints"] else ""
    rival = f" (or {content['rival']})" if content["rival"] else ""
    return f"{content['told']} {content['kind']}{where}{rival}: {named}, since {content['since']}."
