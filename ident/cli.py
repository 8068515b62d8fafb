"""The command `ident`: a sub-command is a line in `COMMANDS`, and is loaded when it runs."""

import importlib
import os
import sys
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from wamctl.arm.command_line import CONTEXT, QuietOption, Version, system_libraries, without_quiet
from wamctl.arm.errors import UserError, did_you_mean

COMMANDS: dict[str, tuple[str, str]] = {
    "design": ("ident.commands.design:design", "Find a motion that makes the parameters visible."),
    "run": ("ident.commands.run:run", "Identify a model from recordings."),
    "validate": ("ident.commands.validate:validate", "Test a model on other recordings."),
    "gap": ("ident.commands.gap:gap", "Find what the model misses, by name."),
    "plan": ("ident.commands.plan:plan", "Choose the motion that tells rival answers apart."),
    "weigh": ("ident.commands.plan:weigh", "Say how well the answers of a plan predicted logs."),
    "fleet": ("ident.commands.fleet:fleet", "Find which of many arms has changed, and in what."),
    "watch": ("ident.commands.watch:watch", "Tell when an arm no longer is what its model says."),
    "simulate": ("ident.commands.simulate:simulate", "Simulate an identified arm in closed loop."),
    "check-urdf": ("ident.commands.check_urdf:check_urdf", "Check and repair an arm's URDF."),
    "import": (
        "ident.commands.import_table:import_table",
        "Convert a table of measurements to a log.",
    ),
    "report": ("ident.commands.report:report", "Compare the results of two runs."),
    "export": ("ident.commands.export:export", "Write the identified arm for other programs."),
}
"""Name of a sub-command: module and function, and what it does in a few words."""

_BUG = 1
_INTERRUPTED = 130
"""What a shell has for a command that Ctrl-C has ended."""


class _Commands(TyperGroup):
    """Loads a sub-command's module only when it is called, so that help and errors come at once."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        module, function = COMMANDS[cmd_name][0].split(":")
        app = typer.Typer(add_completion=False, rich_markup_mode=None)
        app.command(cmd_name, context_settings=CONTEXT)(
            getattr(importlib.import_module(module), function)
        )
        return typer.main.get_command(app)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args[0] not in COMMANDS and not ctx.resilient_parsing:
            ctx.fail(f"No such command {args[0]!r}{did_you_mean(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, words) for name, (_, words) in COMMANDS.items()])


app = typer.Typer(
    cls=_Commands, no_args_is_help=True, rich_markup_mode=None, context_settings=CONTEXT
)


@app.callback(epilog="Every command takes --debug, which shows where an error came from.")
def _ident(version: Version = False, quiet: QuietOption = False) -> None:
    """Identify an arm's dynamics from its recordings."""


def main(arguments: list[str] | None = None) -> None:
    """Entry point: runs a sub-command; an error becomes one sentence and an exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in arguments
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        command = typer.main.get_command(app)
        words = without_quiet([a for a in arguments if a != "--debug"])
        with system_libraries("ident"):
            command.main(words, "ident")
    except SystemExit as ended:
        if ended.code == _INTERRUPTED:
            typer.echo("ident: stopped by Ctrl-C; earlier results are as they were.", err=True)
        raise
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
