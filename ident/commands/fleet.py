"""`ident fleet`: many arms, many logs; which arm has changed, in what, and since when."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import Force, Input, Json
from wamctl.arm.command_line import grouped, next_step


@dataclass(frozen=True)
class Machines:
    """What reads the logs."""

    scheduler: Annotated[
        str | None,
        typer.Option(help="A Dask scheduler: tcp://HOST:8786, or local; default: processes here."),
    ] = None
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Processes on this machine; default: one per processor."
        ),
    ] = None


@dataclass(frozen=True)
class Names:
    """Where it stands which arm a log is of, and when it was recorded."""

    pattern: Annotated[
        str | None,
        typer.Option(help="How the logs' paths end, such as '{arm}/{time}_{temperature}.mcap'."),
    ] = None
    table: Annotated[
        Path | None,
        typer.Option(help="CSV with columns log, arm, time, firmware, tool, temperature."),
    ] = None


@grouped
def fleet(
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOG", help="Folders, globs, or URLs such as s3://bucket/prefix."),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for the results, and for the reduced logs.")
    ] = Path("fleet"),
    robot: Annotated[
        Path | None, typer.Option(help="Arms' .yaml or .urdf; default: what the logs carry.")
    ] = None,
    *,
    machines: Machines,
    names: Names,
    given: Input,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Find which of many arms has changed, in what, and since when.

    Logs that were reduced before are not read again; an interrupted run goes on where it was.

    Example: ident fleet logs/ --robot my_arm.yaml --out fleet
    """
    from ident.commands.outputs import folder_written
    from ident.fleet.engine import Workers
    from ident.fleet.metadata import rules
    from ident.regression.progress import shown
    from ident.workflows.fleet.fleet import FILES, PAGES, fleet_logs

    said = rules(names.pattern, names.table)
    who = Workers(machines.scheduler, machines.workers)
    with folder_written(out, (*FILES, PAGES), force), shown() as tell:
        text = fleet_logs(logs, out, robot, given.reading(), said, who, tell=tell)
    content = json.loads(text)
    for one in content["refused"]:
        typer.echo(f"{one['log']}: {one['remarks'][0].partition(': ')[2]}", err=True)
    if as_json:
        typer.echo(text.rstrip())
        return
    for line in _said(content):
        typer.echo(line)
    typer.echo(f"{out / 'fleet.html'}")
    if content["changes"]:
        next_step("ident gap", content["changes"][0]["first_log"])
    else:
        next_step("repeat this command when there are new logs")


def _said(content: dict[str, Any]) -> list[str]:
    """The result in print."""
    logs, arms = content["logs"], len({a["arm"] for a in content["arms"]})
    lines = [f"{logs['used']} logs of {arms} arms; {logs['refused']} could not be used."]
    for c in content["changes"]:
        where = "" if c["name"] == "payload" else f" at joint {', '.join(map(str, c['joints']))}"
        what = "" if c["name"] == "parameter" else f"{c['name'].replace('_', ' ')}{where}: "
        size = f"{c['parameter']} {c['size']:+.3g} ± {c['sd']:.1g} {c['unit']}"
        lines.append(f"{c['arm']}: {what}{size} since {c['since']}.")
    if not content["changes"]:
        lines.append("No arm has changed beyond what days, temperature and chance explain.")
    return lines
