"""Work on many items through the standard library's `Executor`, whoever provides the workers.

Nothing here schedules: a pool of processes does, or Dask's scheduler. What is added is that only so
many items wait at a time, so that memory does not grow with their number, and that the items of
workers or schedulers that were lost are given out again.
"""

import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TypeVar

from ident.regression.processes import process_pool
from wamctl.arm.errors import ConfigurationError, DataError

Item = TypeVar("Item")
Result = TypeVar("Result")
Make = Callable[[], AbstractContextManager[Executor]]

LOCAL = "local"
"""The scheduler's address that stands for a Dask cluster on this machine."""

_TRIES = 4
"""An item that was lost so often with its worker is given up."""

_AGAIN_S = 2.0
_MOST_WAITING = 4  # items for each worker
_CLUSTER_WORKERS = 32  # of a scheduler whose workers come and go


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Attributes:
        scheduler: address of a Dask scheduler, or `local`; None: processes on this machine.
        count: number of processes on this machine; None: one for each processor.
    """

    scheduler: str | None = None
    count: int | None = None


THIS_MACHINE = Workers()


class LostError(Exception):
    """An item whose worker ended each time before it was done."""


def engine(scheduler: str | None, workers: int | None) -> tuple[Make, int]:
    """What makes executors, and how many items may wait for one.

    Args:
        scheduler: address of a Dask scheduler, `local`, or None for a pool of processes.
        workers: processes on this machine; None: one for each processor.

    Raises:
        ConfigurationError: Dask is wanted, and not installed.
    """
    count = workers or os.cpu_count() or 1
    if scheduler is None:
        return lambda: process_pool(count), _MOST_WAITING * count
    if find_spec("distributed") is None:
        raise ConfigurationError(
            "--scheduler",
            ["needs dask.distributed, which is not installed: pip install 'wam-ident[fleet]'"],
        )
    waiting = _MOST_WAITING * (count if scheduler == LOCAL else _CLUSTER_WORKERS)
    return lambda: _dask(scheduler, count), waiting


@contextmanager
def _dask(scheduler: str, workers: int) -> Iterator[Executor]:
    """Workers of a Dask scheduler as an executor.

    Raises:
        DataError: no scheduler answers there.
    """
    import distributed

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # lost work is given out again
    where = {} if scheduler == LOCAL else {"address": scheduler}
    own = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": ":0"}
    try:
        client = distributed.Client(**where, **({} if where else own), set_as_default=False)
    except (OSError, ValueError) as error:
        raise DataError(
            f"No Dask scheduler answers at {scheduler} ({error}): start one with `dask scheduler`,"
            " or leave --scheduler out."
        ) from error
    with client, client.get_executor(pure=False) as executor:
        yield executor


def done(
    make: Make, function: Callable[[Item], Result], items: Sequence[Item], waiting: int
) -> Iterator[tuple[Item, Result | LostError]]:
    """The results in the order in which they come.

    Args:
        make: makes an executor.
        function: of an importable module.
        items: what it is to be called with.
        waiting: most items that are given out at a time.

    Yields:
        each item with its result, or with the error that says it was lost.
    """
    left = list(enumerate(items))[::-1]
    tries = [0] * len(items)
    careful = False
    while left:
        pending: dict[Future, tuple[int, Item]] = {}
        try:
            with make() as executor:
                while left or pending:
                    while left and len(pending) < (1 if careful else waiting):
                        number, item = left.pop()
                        pending[executor.submit(function, item)] = number, item
                    for future in wait(pending, return_when=FIRST_COMPLETED).done:
                        result = future.result()
                        _, item = pending.pop(future)
                        yield item, result
        except Exception as error:  # any scheduler's; what is no loss of a worker goes on
            if not _lost(error):
                raise
            for number, item in pending.values():
                tries[number] += 1
                left.append((number, item))
            careful = any(tries[number] >= _TRIES // 2 for number, _ in pending.values())
            for number, item in [x for x in left if tries[x[0]] >= _TRIES]:
                left.remove((number, item))
                yield item, LostError(str(error))
            time.sleep(_AGAIN_S)


def _lost(error: BaseException) -> bool:
    """Whether workers or scheduler were lost, so that the work may be given out again."""
    if isinstance(error, BrokenExecutor | CancelledError | ConnectionError | DataError):
        return True
    return type(error).__name__ in ("KilledWorker", "FutureCancelledError", "CommClosedError")
