"""`wamctl investigate`: what is to be investigated, and what it may cost."""

import sys
from contextlib import nullcontext
from pathlib import Path

import typer

from wamctl.arm.config import beside
from wamctl.arm.configuration.known_change import KnownChangeError, known_change
from wamctl.commands.options import Bounds, Experiment, Resumed
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
    given: Experiment, out: Path, costs: Bounds, resumed: Resumed, options: list[str]
) -> Investigation:
    """Investigate, after all has been refused that can be refused before motion.

    Args:
        given: which arm; its trajectory may be unset.
        out: folder for the results.
        costs: what it may cost.
        resumed: whether it goes on where an earlier session has ended.
        options: further options of `wamctl excite`.

    Raises:
        UserError: it could not begin or go on, or another program has the bus.
    """
    path, arm = load_arm(given.config)
    bus = given.bus or arm.file.bus.channel
    prepare(given.config, given.trajectory)
    if given.hidden is not None and bus != EMBEDDED:
        raise UsageError(f"--hidden is for the embedded simulated arm, not for {bus}.")
    own = beside(path, str(arm.file.excitation.trajectory))
    first = str(given.trajectory.resolve() if given.trajectory else own)
    bounds = limited(Budget(wall_s=duration_s(costs.budget)), costs.limit or [])
    request = Request(str(path), bus, given.lockstep, given.hidden, given.seed, first)
    if resumed.answer:
        known_change(resumed.answer)
        if not resumed.resume:
            raise UsageError("--answer goes with --resume: it answers what an investigation asked.")
    with nullcontext() if bus == EMBEDDED else locked(parse_channel(bus)) as lock:
        site = Site(out, arm, tuple(options), say, asked_in_terminal, lock)
        return investigate(site, request, bounds, resumed.resume, resumed.answer)


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
