"""What the three commands have in common: version, quiet, groups of options, commit."""

import importlib.metadata
import inspect
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

R = TypeVar("R")

CONTEXT: dict[str, Any] = {"help_option_names": ["-h", "--help"]}
"""Settings of every command's context."""

_QUIET = "WAM_IDENT_QUIET"
_QUIET_WORDS = ("-q", "--quiet")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"wam-ident {importlib.metadata.version('wam-ident')}")
        raise typer.Exit


Version = Annotated[
    bool,
    typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
]
QuietOption = Annotated[
    bool,
    typer.Option("-q", "--quiet", help="No progress, no advice; before or after the command."),
]


def grouped(command: Callable[..., R]) -> Callable[..., R]:
    """The command with an option for each field of the dataclasses that it takes.

    Typer makes an option of each parameter. Where a parameter is annotated with a dataclass, its
    fields become parameters in its place, with their annotations and defaults, and the command is
    called with the dataclass made of them. All other parameters stay as they are.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters: list[inspect.Parameter] = []
    for given in inspect.signature(command).parameters.values():
        if given.name in groups:
            parameters += _options(groups[given.name])
        else:
            kept = given.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[given.name])
            parameters.append(kept)

    def flat(**options: Any) -> R:
        for name, group in groups.items():
            options[name] = group(**{f.name: options.pop(f.name) for f in fields(group)})
        return command(**options)

    flat.__doc__ = command.__doc__
    flat.__signature__ = inspect.Signature(parameters)  # pyright: ignore[reportFunctionMemberAccess]
    return flat


def _options(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]


def can_missing(command: str) -> str:
    """What a command that needs the CAN libraries says where they are not installed; else empty."""
    missing = [name for name in ("can", "canopen") if find_spec(name) is None]
    if not missing:
        return ""
    return (
        f"{command}: the CAN libraries ({' and '.join(missing)}) are not installed:"
        " pip install 'wam-ident[can]'.\n"
    )


@contextmanager
def system_libraries(command: str) -> Iterator[None]:
    """Says which library of the system is not installed, and exits with 3, where one is missing."""
    try:
        yield
    except ImportError as error:
        library, missing, _ = str(error).partition(": cannot open shared object file")
        if not missing:
            raise
        sys.stderr.write(
            f"{command}: the system's library {library} is not installed: install its package"
            f" (Debian and Ubuntu: apt install {library.replace('.so.', '')}).\n"
        )
        sys.exit(3)


def without_quiet(arguments: list[str]) -> list[str]:
    """The arguments without `-q`, which may stand anywhere and holds for child processes too."""
    if any(word in _QUIET_WORDS for word in arguments):
        os.environ[_QUIET] = "1"
    return [word for word in arguments if word not in _QUIET_WORDS]


def is_quiet() -> bool:
    """Whether nothing but results and errors is to be printed."""
    return bool(os.environ.get(_QUIET))


def next_step(*words: object) -> None:
    """Tell, on standard error, the command that usually comes next, ready for a shell."""
    if not is_quiet():
        quoted = [shlex.quote(str(w)) if isinstance(w, Path) else str(w) for w in words]
        sys.stderr.write(f"Next: {' '.join(quoted)}\n")


def hidden_names(incomplete: str) -> list[str]:
    """Shipped hidden effects that begin like this, for a shell's completion."""
    from wamctl.arm.configuration.yaml_file import shipped_file

    names = [path.stem for path in shipped_file("hidden").glob("*.yaml")]
    return sorted(name for name in names if name.startswith(incomplete))


def shipped_names(incomplete: str) -> list[str]:
    """Shipped arm files and URDFs that begin like this, for a shell's completion."""
    from wamctl.arm.configuration.yaml_file import shipped_file

    names = [p.name for kind in ("*.yaml", "*.urdf") for p in shipped_file("").glob(kind)]
    return sorted(name for name in names if name.startswith(incomplete))


def git_commit() -> str:
    """Commit of the source tree, with `+changes` where it differs; `unknown` outside of one."""
    try:
        _git("ls-files", "--error-unmatch", os.path.basename(__file__))
        commit = _git("rev-parse", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit}+changes" if changed else commit


def _git(*arguments: str) -> str:
    folder = os.path.dirname(__file__)
    done = subprocess.run(
        ["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=10
    )
    return done.stdout.strip()
