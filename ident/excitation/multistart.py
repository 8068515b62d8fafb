"""The search on several processors at once, each from its own starts; the best design is kept."""

import multiprocessing
import queue
import signal
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess
from multiprocessing.queues import Queue

import numpy as np
from numpy.typing import NDArray

from ident.excitation.cobyla import search_by_cobyla
from ident.excitation.evaluate import Candidate
from ident.excitation.problem import Problem
from ident.excitation.search import Effort, search
from ident.excitation.trajectory_grid import Grid
from wamctl.arm.compilation import compilation_announced

Array = NDArray[np.floating]
Report = Callable[[Candidate | None], None]

_GLANCE_S = 0.2


@dataclass(frozen=True)
class Task:
    """What every island works on.

    Attributes:
        problem: objective, constraints and the grid to optimise on.
        dense: grid on which limits and objective are judged.
        effort: when to stop.
        seed: of all random choices; each island takes its own from it.
        start: a design to improve, shape (2 L + 1, n), or None.
        method: `descent`, or `cobyla` as in the paper.
    """

    problem: Problem
    dense: Grid
    effort: Effort
    seed: int
    start: Array | None
    method: str


def best_design(task: Task, processes: int, report: Report) -> Candidate | None:
    """The best design that the islands find, or None where none keeps its limits.

    An interrupt (Ctrl-C) ends the search early and keeps the best design so far.

    Args:
        task: what to work on.
        processes: number of islands.
        report: called with every better design, and with None in between.
    """
    context = multiprocessing.get_context("spawn")
    found: Queue[Candidate | None] = context.Queue()
    islands = [
        context.Process(target=_island, args=(task, number, found), daemon=True)
        for number in range(processes)
    ]
    for island in islands:
        island.start()
    try:
        return _collect(found, islands, report)
    finally:
        for island in islands:
            island.terminate()
            island.join()


def _collect(
    found: "Queue[Candidate | None]", islands: list[SpawnProcess], report: Report
) -> Candidate | None:
    best, running = None, len(islands)
    try:
        while running:
            try:
                candidate = found.get(timeout=_GLANCE_S)
            except queue.Empty:
                if any(island.exitcode for island in islands):
                    raise RuntimeError("a search process died; see its message above") from None
                report(None)
                continue
            if candidate is None:
                running -= 1
            elif best is None or candidate.value < best.value:
                best = candidate
                report(best)
    except KeyboardInterrupt:
        return best
    return best


def _island(task: Task, number: int, found: "Queue[Candidate | None]") -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    seed = int(np.random.SeedSequence([task.seed, number]).generate_state(1)[0])
    method = search_by_cobyla if task.method == "cobyla" else search
    with compilation_announced("the search") if number == 0 else nullcontext():
        for candidate in method(task.problem, task.dense, task.effort, seed, task.start):
            found.put(candidate)
    found.put(None)
