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

from ident.excitation.optimisation.evaluate import Candidate
from ident.excitation.optimisation.search import Effort, search
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.trajectory_grid import Grid
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
    """

    problem: Problem
    dense: Grid
    effort: Effort
    seed: int
    start: Array | None


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
    workers = [
        context.Process(target=_worker, args=(task, number, found), daemon=True)
        for number in range(processes)
    ]
    for worker in workers:
        worker.start()
    try:
        return _collect(found, workers, report)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()


def _collect(
    found: "Queue[Candidate | None]", workers: list[SpawnProcess], report: Report
) -> Candidate | None:
    best, running = None, len(workers)
    try:
        while running:
            try:
                candidate = found.get(timeout=_GLANCE_S)
            except queue.Empty:
                if any(worker.exitcode for worker in workers):
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


def _worker(task: Task, number: int, found: "Queue[Candidate | None]") -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    seed = int(np.random.SeedSequence([task.seed, number]).generate_state(1)[0])
    with compilation_announced("the search") if number == 0 else nullcontext():
        for candidate in search(task.problem, task.dense, task.effort, seed, task.start):
            found.put(candidate)
    found.put(None)
