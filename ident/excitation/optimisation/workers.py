"""Processes to search in, forked from one that imports all they need while the command does so."""

import multiprocessing
from multiprocessing import forkserver, resource_tracker
from multiprocessing.context import ForkServerContext

from ident.regression.processes import started_apart

_PRELOADED = "ident.excitation.optimisation.multistart"


def workers() -> ForkServerContext:
    """What starts processes; it begins to import at its first call, and takes no interrupt."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    resource_tracker.ensure_running()  # before, since its start lets interrupts through again
    with started_apart():
        forkserver.ensure_running()
    return context
