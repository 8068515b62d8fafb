"""Work in several processes, which an interrupt ends at once and quietly."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], workers: int
) -> Iterator[Result]:
    """The function's results in the order of the items, each as soon as those before are there.

    A program that calls this runs its own work under `if __name__ == "__main__":`, as with every
    use of `multiprocessing`.
    """
    before = set(active_children())
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent)
    try:
        with _deaf():
            results = pool.map(function, items)
        yield from results
    except BaseException:
        for worker in set(active_children()) - before:
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    """A program that is killed leaves no process behind."""
    threading.Thread(target=_watch, daemon=True).start()


def _watch() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _deaf() -> Iterator[None]:
    """Interrupts wait, also for good in processes that start meanwhile."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)
