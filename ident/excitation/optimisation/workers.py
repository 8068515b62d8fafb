"""Processes to search in, forked from one that imports all they need while the command does so."""

import multiprocessing
import signal
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext

_PRELOADED = "ident.excitation.optimisation.multistart"


def workers() -> ForkServerContext:
    """What starts processes; it begins to import at its first call, and takes no interrupt."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # the workers inherit it
    forkserver.ensure_running()
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    return context
