"""The command `ident`: a sub-command is a line in `COMMANDS`, and is loaded when it runs."""

import importlib
import os
import sys
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from wamctl.arm.errors import UserError

COMMANDS: dict[str, tuple[str, str]] = {
    "design": ("ident.commands.design:design", "Find a motion that makes the parameters visible."),
    "run": ("ident.commands.run:run", "Identify a model from recordings."),
    "validate": ("ident.commands.validate:validate", "Test a model on other recordings."),
    "gap": ("ident.commands.gap:gap", "Find what the model misses, by name."),
    "simulate": ("ident.commands.simulate:simulate", "Simulate an identified arm in closed loop."),
    "import": ("ident.commands.import_table:import_table", "Turn a foreign table into a log."),
    "report": ("ident.commands.report:report", "Put the results of two runs beside each other."),
    "export": ("ident.commands.export:export", "Write the identified arm for other programs."),
}
"""Name of a sub-command: module and function, and what it does in a few words."""

_BUG = 1


class _Commands(TyperGroup):
    """Loads a sub-command's module only when it is called, so that help and errors come at once."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        module, function = COMMANDS[cmd_name][0].split(":")
        app = typer.Typer(add_completion=False)
        app.command(cmd_name)(getattr(importlib.import_module(module), function))
        return typer.main.get_command(app)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, words) for name, (_, words) in COMMANDS.items()])


app = typer.Typer(cls=_Commands, no_args_is_help=True, rich_markup_mode=None)


@app.callback(epilog="Every command takes --debug, which shows where an error came from.")
def _ident() -> None:
    """Identify an arm's dynamics from its recordings."""


def main(arguments: list[str] | None = None) -> None:
    """Entry point: runs a sub-command; an error becomes one sentence and an exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in arguments
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        command = typer.main.get_command(app)
        command.main([a for a in arguments if a != "--debug"], "ident")
    except UserError as error:
        if debug:
            traceback.print_exc()
        typer.echo(f"ident: {error}", err=True)
        sys.exit(error.exit_code)
    except Exception as error:  # noqa: BLE001 - the last place: a bug must not look like a result
        if debug:
            traceback.print_exc()
        typer.echo(
            f"ident: this is a bug ({type(error).__name__}: {error}); run it with --debug"
            " and report what it prints.",
            err=True,
        )
        sys.exit(_BUG)


if __name__ == "__main__":
    main()
