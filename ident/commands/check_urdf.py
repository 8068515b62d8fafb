"""`ident check-urdf`: can such an arm exist, and does a recording bear it out."""

import json
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from ident.commands.options import Input, Output
from ident.workflows.check_urdf import UrdfCheck
from wamctl.arm.command_line import grouped, next_step

_FAULTS, _NO_RESULT = 3, 6


@grouped
def check_urdf(
    file: Annotated[Path, typer.Argument(help="The URDF, or the bare name of a shipped one.")],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="LOG", help="Recordings of this arm, to test its masses."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Repaired URDF to write; without it nothing is written.")
    ] = None,
    *,
    given: Input,
    output: Output,
) -> None:
    """Check whether the arm of a URDF can exist, and repair what can be repaired.

    The exit code is 3 if faults are left, and 6 if the recording was refused or, with --strict,
    contradicts a mass.

    Example: ident check-urdf wam7.urdf --out repaired.urdf
    """
    from ident.commands.outputs import file_written
    from ident.regression.progress import shown
    from ident.workflows.check_urdf import check_urdf as check

    with nullcontext() if out is None else file_written(out, output.force), shown() as tell:
        checked = check(file, logs or [], out, given.reading(), tell)
    if output.as_json:
        typer.echo(json.dumps(checked.content(), indent=2, ensure_ascii=False))
    else:
        typer.echo("\n".join(_lines(checked)))
    if logs:
        next_step("ident run", *logs, "--robot", out or file)
    elif checked.examined.faults and out is None:
        next_step("ident check-urdf", file, "--out repaired.urdf")
    _end(checked, output.strict)


def _end(checked: UrdfCheck, strict: bool) -> None:
    if checked.verdict == "impossible":
        raise typer.Exit(_FAULTS)
    recording, masses = checked.recording, checked.weighed
    if recording.get("verdict") == "refused" or (strict and masses and masses.contradictions):
        raise typer.Exit(_NO_RESULT)


def _lines(checked: UrdfCheck) -> Iterator[str]:
    for finding in checked.examined.findings:
        end = "" if finding.repair is None else f" -> {finding.repaired_to}"
        yield f"{finding.grade}: {finding.kind} {finding.name}: {finding.sentence}{end}"
    yield from _recording(checked)
    yield checked.sentence


def _recording(checked: UrdfCheck) -> Iterator[str]:
    if not checked.recording:
        return
    yield from (remark["sentence"] for remark in checked.recording["remarks"])
    errors = checked.recording.get("relative_error_percent")
    if errors is None:
        return  # refused
    if checked.weighed is None:
        yield (
            f"Recording: with identified links, the torque is off by {errors['identified']:.1f} %."
            " The URDF has no masses to compare them with."
        )
        return
    yield (
        f"Recording: with the URDF's links, without friction, the torque is off by"
        f" {errors['urdf']:.1f} %, with identified links by {errors['identified']:.1f} %."
    )
    for mass in checked.weighed.contradictions:
        yield f"mass: {mass.sentence}"
    if not checked.weighed.contradictions:
        yield "The recording contradicts no mass."
    if checked.weighed.unseen:
        listed = ", ".join(map(str, checked.weighed.unseen))
        noun = "joint" if len(checked.weighed.unseen) == 1 else "joints"
        yield f"This motion would not show twice the mass behind {noun} {listed}."
