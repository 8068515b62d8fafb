"""Work in several processes, which an interrupt ends at once and quietly."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from types import ModuleType
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int
) -> Iterator[Result]:
    """The function's results in the order of the items, each as soon as those before are there.

    The function has to be one of an importable module: a process does not run the caller's script
    again, so that this also works in a script without a `__main__` guard and in a notebook.
    """
    with process_pool(workers) as pool:
        yield from pool.map(function, items)


@contextmanager
def process_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes, ended with the block: at once where an error or interrupt ends it."""
    before = set(active_children())
    pool = _Pool(workers, get_context("spawn"), _end_with_parent)
    try:
        yield pool
    except BaseException:  # Ctrl-C too must leave no process behind
        for worker in set(active_children()) - before:
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    def submit(self, *args: Any, **kwargs: Any) -> Future:
        """As of any executor; processes start here."""
        with started_apart():
            return super().submit(*args, **kwargs)


def _end_with_parent() -> None:
    """A program that is killed leaves no process behind."""
    threading.Thread(target=_watch, daemon=True).start()


def _watch() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def started_apart() -> Iterator[None]:
    """Processes that start meanwhile take no interrupt, nor run the program's main module again."""
    with _interrupts_blocked(), _without_main():
        yield


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Interrupts wait, also for good in processes that start meanwhile."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)


@contextmanager
def _without_main() -> Iterator[None]:
    """Processes that start meanwhile do not import the program's main module."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
