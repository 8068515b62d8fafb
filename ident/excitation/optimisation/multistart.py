"""The search on several processors at once, each from its own starts; the best design is kept."""

import queue
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from multiprocessing.context import ForkServerProcess
from multiprocessing.queues import Queue
from multiprocessing.synchronize import Event

import numpy as np

from ident.excitation.optimisation.augmented_lagrangian import COARSE_STAGES
from ident.excitation.optimisation.evaluate import Candidate
from ident.excitation.optimisation.search import Effort, random_start, search
from ident.excitation.optimisation.workers import workers
from ident.excitation.problem.design_problem import Penalty, Problem, lagrangian
from ident.excitation.problem.trajectory_grid import Grid
from ident.regression.processes import started_apart
from ident.signals.arrays import Array
from wamctl.arm.compilation import compilation_announced

Report = Callable[[Candidate | None], None]

_GLANCE_S = 0.2


@dataclass(frozen=True)
class Task:
    """What every search works on.

    Attributes:
        problem: objective, constraints and the grid to optimise on.
        dense: grid on which limits and objective are judged.
        effort: when to stop.
        seed: of all random choices; each search takes its own from it.
        start: a design to improve, shape (2 L + 1, n), or None.
    """

    problem: Problem
    dense: Grid
    effort: Effort
    seed: int
    start: Array | None


def best_design(task: Task, processes: int, report: Report) -> Candidate | None:
    """The best design that the searches find, or None where none keeps its limits.

    An interrupt (Ctrl-C) ends the search early and keeps the best design so far.

    Args:
        task: what to work on.
        processes: number of searches.
        report: called with every better design, and with None in between.
    """
    context = workers()
    found: Queue[Candidate | None] = context.Queue()
    compiled = context.Event()
    searches = [
        context.Process(target=_worker, args=(task, number, found, compiled), daemon=True)
        for number in range(processes)
    ]
    with started_apart():
        for search in searches:
            search.start()
    try:
        return _collect(found, searches, report)
    finally:
        for search in searches:
            search.terminate()
            search.join()


def _collect(
    found: "Queue[Candidate | None]", searches: list[ForkServerProcess], report: Report
) -> Candidate | None:
    best, running = None, len(searches)
    try:
        while running:
            try:
                candidate = found.get(timeout=_GLANCE_S)
            except queue.Empty:
                if any(search.exitcode for search in searches):
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


def _warm_up(task: Task, rng: np.random.Generator) -> None:
    """Compile, or load, all that a search needs: that is no part of its time."""
    first = random_start(task.problem, rng)
    penalty = Penalty(np.zeros(1), 1.0)
    lagrangian(task.problem, first, COARSE_STAGES[0].smoothness, penalty)


def _worker(task: Task, number: int, found: "Queue[Candidate | None]", compiled: Event) -> None:
    """A search; the first one compiles for all, and the others load what it has compiled."""
    seed = int(np.random.SeedSequence([task.seed, number]).generate_state(1)[0])
    with compilation_announced("the search") if number == 0 else nullcontext():
        if number > 0:
            compiled.wait()
        _warm_up(task, np.random.default_rng(seed))
        compiled.set()
        effort = replace(task.effort, deadline=task.effort.deadline.again())
        for candidate in search(task.problem, task.dense, effort, seed, task.start):
            found.put(candidate)
    found.put(None)
