"""`ident plan` and `ident weigh`: the next motion of an investigation, and what it has shown."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Force, Json, Logs
from ident.commands.outputs import file_written, folder_written
from wamctl.arm.command_line import grouped, next_step


@dataclass(frozen=True)
class Known:
    """What the investigation knows beyond its logs."""

    ran: Annotated[
        list[str] | None,
        typer.Option(metavar="MOTION", help="A motion that is not to be repeated."),
    ] = None
    lead: Annotated[
        str | None,
        typer.Option(help="Rival that leads, such as stribeck:4; by default what --gap says."),
    ] = None
    changed: Annotated[
        str | None,
        typer.Option(
            metavar="CHANGE",
            help="What was done to the arm: load=KG,X,Y,Z (at the tool, [m]) or tilt=X,Y [deg].",
        ),
    ] = None


@grouped
def plan(
    logs: Logs,
    config: Annotated[Path, typer.Option(help="Arm's file, or the bare name of a shipped one.")],
    gap: Annotated[Path, typer.Option(help="Folder of `ident gap` on the same logs.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("plan"),
    *,
    known: Known,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Choose the motion that tells rival answers apart, and write down what each predicts.

    Example: ident plan log.mcap --config wam7.yaml --gap gap --out plan
    """
    from ident.workflows.plan import plan_logs
    from wamctl.arm.compilation import compilation_announced
    from wamctl.arm.configuration.known_change import known_change

    change = known_change(known.changed or "again")
    names = ("plan.json", "trajectory.yaml", "slow.yaml", "models")
    with folder_written(out, names, force), compilation_announced("the search"):
        content = plan_logs(logs, gap, config, out, known.ran or [], _tell, change, known.lead)
    motion = content["motion"]
    if as_json:
        typer.echo(json.dumps(content, indent=2))
    else:
        for rival, nats in motion["expected_nats"].items():
            typer.echo(f"{motion['name']}: {content['leader']} over {rival}, {nats:.1f} nats")
        typer.echo(f"{out / 'trajectory.yaml'}")
    next_step("wamctl excite --config", config, "--trajectory", out / "trajectory.yaml")


def weigh(
    logs: Logs,
    plan: Annotated[Path, typer.Option(help="Folder of `ident plan`.")],
    out: Annotated[Path, typer.Option(help="File for the result.")] = Path("weights.json"),
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Say how well the answers of a plan predicted logs that were recorded after it.

    Example: ident weigh next.mcap --plan plan --out weights.json
    """
    from ident.workflows.plan import weigh_logs

    with file_written(out, force):
        text = json.dumps(weigh_logs(logs, plan, _tell), indent=2)
        out.write_text(text, encoding="utf-8")
    typer.echo(text if as_json else f"{out}")
    next_step("ident gap with all logs so far, these included:", *logs)


def _tell(what: str) -> None:
    typer.echo(what, err=True)
