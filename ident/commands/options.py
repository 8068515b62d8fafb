"""Options that the commands share, and what they mean."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from ident.checks.remark import verdict_said
from wamctl.arm.config import IdentificationSection
from wamctl.arm.errors import ConfigurationError


class Torque(StrEnum):
    """Which torque of a log to use."""

    COMMANDED = "commanded"
    MEASURED = "measured"


Logs = Annotated[list[Path], typer.Argument(help="Logs: .mcap files or ROS 2 bag folders.")]
Cutoff = Annotated[
    float | None,
    typer.Option("--cutoff", help="Low-pass cut-off [Hz]; short for --set cutoff_hz=."),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="NAME=VALUE of the file's identification section, e.g. terms=viscous,coulomb,offset.",
    ),
]
TorqueChoice = Annotated[
    Torque | None,
    typer.Option("--torque", help="Torque to use; default: the commanded one where there is one."),
]
JointStates = Annotated[
    str, typer.Option("--joint-states", help="Topic of the measured positions and efforts.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result file's content.")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit with 6 where the result is doubtful.")]

Rename = Annotated[
    list[str] | None,
    typer.Option(
        "--rename", help="FROM=TO: part of the log's joint names, and what the arm has for it."
    ),
]

_NO_RESULT = 6


def rules_of(renames: list[str] | None) -> tuple[tuple[str, str], ...]:
    """The replacements that --rename asks for.

    Raises:
        ConfigurationError: not FROM=TO.
    """
    rules = []
    for text in renames or []:
        old, equals, new = text.partition("=")
        if not equals or not old:
            raise ConfigurationError("--rename", [f"{text!r} is not FROM=TO"])
        rules.append((old, new))
    return tuple(rules)


def verdict_printed(content: Mapping[str, Any], verdict: str = "verdict") -> None:
    """Print the verdict of a result file, and its remarks."""
    sentences = [r["sentence"] for r in content["remarks"]]
    for sentence in verdict_said(content[verdict], sentences):
        typer.echo(sentence)


def hold(word: str, strict: bool) -> None:
    """End with the exit code of a result that --strict does not let pass."""
    if strict and word != "trustworthy":
        raise typer.Exit(_NO_RESULT)


def settings_of(cutoff: float | None, assignments: list[str] | None) -> dict[str, Any]:
    """The settings that the command line changes.

    Raises:
        ConfigurationError: not NAME=VALUE, or no such setting; the sentence lists the valid names.
    """
    changes: dict[str, Any] = {} if cutoff is None else {"cutoff_hz": cutoff}
    known = IdentificationSection.model_fields
    for text in assignments or []:
        name, equals, value = text.partition("=")
        if not equals or name not in known:
            valid = ", ".join(sorted(known))
            raise ConfigurationError(
                "--set", [f"{text!r} is not NAME=VALUE with a NAME of {valid}"]
            )
        changes[name] = _value(value, isinstance(known[name].default, tuple))
    return changes


def _value(text: str, several: bool) -> Any:
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError("--set", [f"{text!r} is not a value ({error})"]) from error
    return (
        [part.strip() for part in value.split(",")] if several and isinstance(value, str) else value
    )
