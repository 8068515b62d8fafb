"""`wamctl investigate`: what is to be investigated, and what it may cost."""

import sys
from contextlib import nullcontext
from pathlib import Path

import typer

from wamctl.arm.config import beside
from wamctl.arm.configuration.known_change import KnownChangeError, known_change
from wamctl.commands.text_output import say
from wamctl.drives.bus import EMBEDDED, parse_channel
from wamctl.drives.one_master import locked
from wamctl.errors import UsageError
from wamctl.experiment.preflight import load_arm, prepare
from wamctl.investigation.budget import Budget, duration_s, limited
from wamctl.investigation.investigate import Investigation, investigate
from wamctl.investigation.rounds import Site
from wamctl.investigation.state import Request


def investigated(
    request: Request,
    out: Path,
    budget: tuple[str, list[str]],
    resume: bool,
    options: list[str],
    answer: str = "",
) -> Investigation:
    """Investigate, after all has been refused that can be refused before motion.

    Args:
        request: which arm; its trajectory may be unset.
        out: folder for the results.
        budget: time on the clock such as `10min`, and further bounds as NAME=VALUE.
        resume: go on where an earlier session has ended.
        options: further options of `wamctl excite`.
        answer: what the operator has done to the arm since the last session; empty for nothing.

    Raises:
        UserError: it could not begin or go on, or another program has the bus.
    """
    path, arm = load_arm(request.config)
    prepare(request.config, request.trajectory)
    if request.hidden is not None and request.bus != "sim":
        raise UsageError(f"--hidden is for the embedded simulated arm, not for {request.bus}.")
    own = beside(path, str(arm.file.excitation.trajectory))
    first = str(Path(request.trajectory).resolve() if request.trajectory else own)
    bounds = limited(Budget(wall_s=duration_s(budget[0])), budget[1])
    full = Request(str(path), request.bus, request.lockstep, request.hidden, request.seed, first)
    if answer:
        known_change(answer)
        if not resume:
            raise UsageError("--answer goes with --resume: it answers what an investigation asked.")
    with nullcontext() if request.bus == EMBEDDED else locked(parse_channel(request.bus)) as lock:
        site = Site(out, arm, tuple(options), say, asked_in_terminal, lock)
        return investigate(site, full, bounds, resume, answer)


def asked_in_terminal(question: str) -> str:
    """The operator's answer, once it is one; empty where he ends it, or nobody is there."""
    if not sys.stdin.isatty():
        return ""
    typer.echo(question, err=True)
    while True:
        answer = typer.prompt("Answer, or nothing to end", default="", show_default=False, err=True)
        try:
            if answer:
                known_change(answer)
            return answer
        except KnownChangeError as error:
            typer.echo(str(error), err=True)
