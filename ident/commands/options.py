"""Options that the commands share, and what they mean."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import yaml
from pydantic import BaseModel

from ident.checks.remark import Remark, speaks_against_input, verdict_said
from wamctl.arm.command_line import next_step, shipped_names
from wamctl.arm.config import IdentificationSection
from wamctl.arm.errors import ConfigurationError, did_you_mean

if TYPE_CHECKING:
    from ident.recordings.loading import Reading


class Torque(StrEnum):
    """Which torque of a log to use."""

    COMMANDED = "commanded"
    MEASURED = "measured"


class Method(StrEnum):
    """How to identify."""

    AUTO = "auto"
    REGRESSION = "regression"
    SIMULATION = "simulation"


MethodChoice = Annotated[
    Method,
    typer.Option(
        "--method",
        help="regression: torque from motion; simulation: positions from commanded positions, or"
        " from torque where a log holds none of them; auto: simulation where the logs hold no"
        " torque of use.",
    ),
]

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG", help="Logs: .mcap files, ROS 2 bag folders or ROS 1 .bag files."),
]
Cutoff = Annotated[
    float | None,
    typer.Option("--cutoff", help="Low-pass cut-off [Hz]; the same as --set cutoff_hz=VALUE."),
]


def listing(model: type[BaseModel]) -> Callable[[list[str] | None], list[str] | None]:
    """A callback for --set that answers `help` with the settings of a model, at once."""

    def answer(given: list[str] | None) -> list[str] | None:
        if "help" in (given or ()):
            for name, field in model.model_fields.items():
                default = "" if field.default is None else f" (default: {field.default})"
                text = (
                    f"{field.description or ''}{default if field.default_factory is None else ''}"
                )
                typer.echo(name)
                typer.echo(textwrap.fill(text, 78, initial_indent="    ", subsequent_indent="    "))
            raise typer.Exit
        return given

    return answer


Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        callback=listing(IdentificationSection),
        is_eager=True,
        metavar="NAME=VALUE",
        help="An identification setting, such as terms=viscous,coulomb,offset; `--set help` lists"
        " them.",
    ),
]
TorqueChoice = Annotated[
    Torque | None,
    typer.Option("--torque", help="Which torque to use; default: commanded, where the log has it."),
]
JointStates = Annotated[
    str, typer.Option("--joint-states", help="Topic with measured positions and efforts.")
]
JointCommands = Annotated[
    str,
    typer.Option("--joint-commands", help="Topic with commands, a JointState or JointTrajectory."),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result file instead of a summary.")]
Force = Annotated[
    bool,
    typer.Option(
        "--force", help="Overwrite earlier results instead of keeping them in `previous`."
    ),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with code 6 if the result is doubtful.")
]

Robot = Annotated[
    Path | None,
    typer.Option(
        help="The arm's .yaml or .urdf file; default: the one inside the log.",
        autocompletion=shipped_names,
    ),
]
Rename = Annotated[
    list[str] | None,
    typer.Option(
        "--rename",
        metavar="FROM=TO",
        help="Replace this part of the log's joint names, to match the arm's.",
    ),
]


@dataclass(frozen=True)
class Input:
    """How logs are read."""

    torque: TorqueChoice = None
    joint_states: JointStates = "/joint_states"
    joint_commands: JointCommands = "/joint_commands"
    rename: Rename = None

    def reading(self) -> "Reading":
        """The same in the words of `ident.recordings`.

        Raises:
            ConfigurationError: --rename is not FROM=TO.
        """
        from ident.recordings.loading import Reading

        source = self.torque.value if self.torque else None
        return Reading(self.joint_states, self.joint_commands, source, rules_of(self.rename))


@dataclass(frozen=True)
class Output:
    """What is printed, when the command fails, and what becomes of earlier results."""

    as_json: Json = False
    strict: Strict = False
    force: Force = False


CORRECTED = "follow the advice above, then repeat this command"
"""The next step where recordings or arm should be mended first."""

_NO_RESULT = 6


def effect_names(incomplete: str) -> list[str]:
    """Ids of effects that begin like this, for a shell's completion."""
    from ident.effects.catalogue import catalogue

    return sorted(name for name in catalogue() if name.startswith(incomplete))


def rules_of(renames: list[str] | None) -> tuple[tuple[str, str], ...]:
    """The replacements that --rename asks for.

    Raises:
        ConfigurationError: not FROM=TO.
    """
    rules = []
    for text in renames or []:
        old, equals, new = text.partition("=")
        if not equals or not old:
            raise ConfigurationError(
                "--rename", [f"{text!r} is not FROM=TO, such as fer_joint=panda_joint"]
            )
        rules.append((old, new))
    return tuple(rules)


def refuse_with_simulation(given: Sequence[str], remarks: Sequence[Remark] = ()) -> None:
    """Options of the regression say nothing to a simulation.

    Args:
        given: the options.
        remarks: why the simulation was chosen, if nobody asked for it.

    Raises:
        ConfigurationError: some were given.
    """
    if given:
        why = " ".join(r.finding for r in remarks)
        belongs = f"{', '.join(given)} belongs to the regression; leave it out"
        or_ask = f"{belongs}, or ask for it (--method regression). {why.rstrip('.')}"
        raise ConfigurationError("--method simulation", [or_ask if remarks else belongs])


def recordings_told(content: Mapping[str, Any]) -> None:
    """Say on standard error what was repaired or left out of each recording."""
    for log in content.get("logs", []):
        for remark in log.get("remarks", []):
            typer.echo(f"{log['name']}: {remark}.", err=True)


def verdict_printed(content: Mapping[str, Any]) -> None:
    """Print the verdict of a result file, and its remarks; of a search, that on its recordings."""
    sentences = [r["sentence"] for r in content["remarks"]]
    of = "these recordings" if "trust" in content else "this result"
    for sentence in verdict_said(content.get("trust", content["verdict"]), sentences, of):
        typer.echo(sentence)


def next_after(
    verdict: str,
    remarks: Sequence[Mapping[str, Any]],
    usual: Sequence[object],
    recordings: Sequence[object],
) -> None:
    """Tell the next step: the usual one only where nothing speaks against the result.

    Args:
        verdict: on the recordings.
        remarks: of the result file.
        usual: the command that follows a trustworthy result.
        recordings: with the options that say how they are read.
    """
    if verdict == "trustworthy":
        next_step(*usual)
    elif speaks_against_input(remarks):
        next_step(CORRECTED)
    else:
        next_step("ident gap", *recordings)


def with_input(
    logs: Sequence[Path],
    robot: Path | None,
    reading: "Reading",
    changes: Mapping[str, Any] | None = None,
) -> list[object]:
    """The recordings, and the options that say how they are read, as they are typed.

    Args:
        logs: the recordings.
        robot: file that describes the arm.
        reading: how they are read.
        changes: settings that were given by --set.
    """
    usual = type(reading)()
    words = list[object](logs)
    if robot is not None:
        words += ["--robot", robot]
    if reading.joint_states != usual.joint_states:
        words += ["--joint-states", reading.joint_states]
    if reading.joint_commands != usual.joint_commands:
        words += ["--joint-commands", reading.joint_commands]
    if reading.torque is not None:
        words += ["--torque", reading.torque]
    for old, new in reading.rules:
        words += ["--rename", f"{old}={new}"]
    for name, value in (changes or {}).items():
        text = ",".join(map(str, value)) if isinstance(value, list) else value
        words += ["--set", f"{name}={text}"]
    return words


def hold(word: str, strict: bool) -> None:
    """End with the exit code of a result that --strict does not let pass."""
    if strict and word != "trustworthy":
        raise typer.Exit(_NO_RESULT)


def settings_of(cutoff: float | None, assignments: list[str] | None) -> dict[str, Any]:
    """The identification settings that the command line changes; errors as of `assigned`."""
    changes = {} if cutoff is None else {"cutoff_hz": cutoff}
    return changes | assigned(assignments, IdentificationSection)


def assigned(assignments: list[str] | None, model: type[BaseModel]) -> dict[str, Any]:
    """Settings written as NAME=VALUE, with YAML values; words between commas are a list.

    Raises:
        ConfigurationError: not NAME=VALUE, or no such setting; the sentence lists the valid names.
    """
    changes: dict[str, Any] = {}
    known = model.model_fields
    for text in assignments or []:
        name, equals, value = text.partition("=")
        if not equals or name not in known:
            valid = ", ".join(sorted(known))
            wrong = f"{text!r} is not NAME=VALUE with a NAME of {valid}"
            raise ConfigurationError("--set", [wrong + did_you_mean(name, known)])
        try:
            parsed = yaml.safe_load(value)
        except yaml.YAMLError as error:
            raise ConfigurationError("--set", [f"{value!r} is not a value ({error})"]) from error
        listed = isinstance(parsed, str) and "tuple" in str(known[name].annotation)
        changes[name] = [part.strip() for part in parsed.split(",")] if listed else parsed
    return changes
