"""`ident export`: an identified model for other programs."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ident.commands.options import Force
from ident.commands.outputs import file_written
from ident.effects.bound_effects import load_model
from ident.export.formats import WRITERS
from ident.export.replay import Replay, replay, rms_of
from ident.export.servos import isaaclab_settings, not_in_mjcf, servo_mjcf, servo_replay
from ident.model.identified_model import Model
from ident.output_error.recordings import segments_of
from ident.output_error.servo_model import is_servo_model, read_servo_model
from ident.report.page import render
from ident.report.replay_page import ReplayReport, replay_page
from wamctl.arm.command_line import next_step
from wamctl.arm.errors import ConfigurationError, write_text
from wamctl.arm.recording import read_recording


class Format(StrEnum):
    """What an identified arm can be written as."""

    URDF = "urdf"
    MJCF = "mjcf"
    C = "c"
    PYTHON = "python"
    ISAACLAB = "isaaclab"


_NEEDS_SERVOS = "{} drives its joints by torque; only a model of ident run --method simulation fits"
_SIMULATORS = {"mujoco": "the exported arm in MuJoCo", "own": "ident simulate"}


def export(
    model: Annotated[Path, typer.Argument(help="A model.yaml from `ident run` or `ident gap`.")],
    to: Annotated[Format, typer.Option(help="Format to write.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    log: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            help="With mjcf: a log for MuJoCo to follow in closed loop; drawn in NAME.replay.html.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    force: Force = False,
) -> None:
    """Write an identified arm for other programs.

    URDF and MJCF hold the whole arm; the C header and the Python module compute its torque, with
    every named effect that needs no history.

    Example: ident export identified/model.yaml --to mjcf --out arm.xml --replay log.mcap
    """
    if is_servo_model(model):
        summary = _export_servos(model, to, out, log, force)
        _told(summary, log, as_json=as_json)
        return
    if to is Format.ISAACLAB:
        raise ConfigurationError("--to isaaclab", [_NEEDS_SERVOS.format(model)])
    identified = load_model(model)
    write, left_out = WRITERS[to.value]
    text = write(identified)
    with file_written(out, force):
        write_text(out, text)
    summary: dict[str, Any] = {
        "file": str(out),
        "format": to.value,
        "left_out": left_out(identified),
    }
    if log is not None:
        replays = [_replayed(to, text, identified, log)]
        summary |= _page_written(model, identified.arm, summary, replays, force)
    _told(summary, log, as_json=as_json)


def _export_servos(
    path: Path, to: Format, out: Path, log: Path | None, force: bool
) -> dict[str, Any]:
    """Write an arm with position servos, and replay it; gives the summary."""
    writers = {Format.MJCF: servo_mjcf, Format.ISAACLAB: isaaclab_settings}
    if to not in writers or (log is not None and to is not Format.MJCF):
        asked = f"--to {to.value}" + (" with --replay" if log else "")
        raise ConfigurationError(
            asked, [f"{path} holds position servos: --to mjcf (with --replay LOG) or isaaclab"]
        )
    model = read_servo_model(path)
    text, missing = writers[to](model), not_in_mjcf(model) if to is Format.MJCF else []
    with file_written(out, force):
        write_text(out, text)
    summary: dict[str, Any] = {"file": str(out), "format": to.value, "left_out": missing}
    if log is not None:
        recording = read_recording(log, torque=False)
        stretches = segments_of(recording, model.robot.joint_names, str(log))
        replays = servo_replay(text, model, stretches)
        summary |= _page_written(path, model.arm, summary, replays, force)
    return summary


def _page_written(
    model: Path, arm: str, summary: dict[str, Any], replays: list[Replay], force: bool
) -> dict[str, Any]:
    """Draw recordings beside both simulations; gives what the summary says of it."""
    file = Path(summary["file"])
    page = file.with_name(f"{file.stem}.replay.html")
    with file_written(page, force):
        report = ReplayReport(arm, file, model, summary["left_out"], replays)
        write_text(page, render(replay_page(report)))
    return {"replay_rms_rad": rms_of(replays), "replay_page": str(page)}


def _told(summary: dict[str, Any], log: Path | None, *, as_json: bool) -> None:
    """Print what was written, what was left out, and how a replay went."""
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
        return
    for sentence in summary["left_out"]:
        typer.echo(f"{summary['file']}: {sentence}.", err=True)
    for name, values in summary.get("replay_rms_rad", {}).items():
        words = ", ".join(f"{x:.2g}" for x in values)
        typer.echo(f"{log}: rms joint error of {_SIMULATORS[name]} {words} rad", err=True)
    typer.echo(summary["file"])
    if "replay_page" in summary:
        typer.echo(summary["replay_page"])
    if summary["format"] == Format.MJCF and log is None:
        next_step("the same with --force --replay LOG.mcap, LOG of wamctl excite, to compare them")


def _replayed(to: Format, text: str, model: Model, log: Path) -> Replay:
    """A log beside MuJoCo and the own simulation along it."""
    if to is not Format.MJCF:
        raise ConfigurationError("--replay", [f"goes with --to mjcf, not with --to {to.value}"])
    return replay(text, model, read_recording(log), str(log))
