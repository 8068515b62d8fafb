"""The thresholds of one data set, from effect-free data of the fitted arm."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.effects.events import CONTACT
from ident.gap.data.experiment import Experiment, controller_of, wire_of
from ident.gap.data.reference_model import known_torque
from ident.gap.data.segments import segments
from ident.gap.data.windows import Windows
from ident.gap.lack_of_fit.remaining_structure import noise, remaining_structures
from ident.gap.regression.current_model import (
    SEARCHED,
    CurrentFit,
    all_hypotheses,
    examine,
    extend,
    nominal_fit,
)
from ident.gap.regression.design_matrix import (
    FOLDS,
    Table,
    WindowedRows,
    build_design_matrix,
    windowed_rows,
)
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.scoring import noise_gains
from ident.gap.regression.weighted_fit import Fit, fit
from ident.gap.selection.null_arms import (
    Threshold,
    can_simulate,
    null_arm,
    phase_randomised,
    raised,
    simulated_datasets,
)
from ident.gap.transients.detect import find_transient
from ident.recordings.dataset import Dataset
from ident.regression.processes import in_processes
from ident.simulation.arm import SimulatedArm, simulated_arm
from ident.simulation.loop import Controller, Wire
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]
Tell = Callable[[str], None]

_CHANCE_DRAWS = 100
_CHANCE_QUANTILE = 0.99
_WORTH_PROCESSES = 40_000  # samples: fewer are searched before another process is ready


def calibrated(
    source: Experiment,
    rows: WindowedRows,
    models: tuple[CurrentFit, CurrentFit],
    threshold: Threshold,
    runs: tuple[int, int],
    tell: Tell,
) -> Threshold:
    """The threshold with simulated runs of the present model behind it.

    The noise is what the model with the effects in question leaves: were they no effects, it would
    be the same.

    Args:
        source: the recordings.
        rows: their rows.
        models: the model so far, and with the effects in question.
        threshold: what is asked for already.
        runs: number of simulated runs, and the first one's seed.
        tell: hears of the progress.
    """
    present, larger = models
    hypotheses = all_hypotheses(present.model.facts)
    table = build_design_matrix(rows, present.model, present.accepted, hypotheses)
    after = build_design_matrix(rows, larger.model, larger.accepted)
    threshold = _with_chance(threshold, table, present, residuals(after, larger.fit))
    left = noise(rows, larger)
    loop = controller_of(source), wire_of(source)
    if loop[0] is None or loop[1] is None or not can_simulate(source):
        return threshold
    fitted = feasible_fit(source, present.fit, len(rows.kept))
    n = source.arm.robot.dof
    nothing = simulated_arm(present.model.facts.chain, np.zeros(10 * n), np.zeros(n), np.zeros(n))
    arm = null_arm(fitted, present.accepted, nothing)
    run = partial(_run, _Plan(source, arm, (loop[0], loop[1]), rows.windows, rows.kept, present))
    draws = []
    for draw in range(runs[0]):
        rng = np.random.default_rng(runs[1] + draw)
        noises = [_disturbance(rows, left, log, d, rng) for log, d in enumerate(source.datasets)]
        draws.append((noises, rng))
    tell(f"simulating {runs[0]} effect-free runs")
    found = []
    for done, outcome in enumerate(_in_turn(run, draws, source)):
        tell(f"effect-free run {done + 1} of {runs[0]} searched")
        if outcome is not None:
            found.append(outcome)
    return raised(threshold, [gains for gains, _ in found], [most for _, most in found])


@dataclass(frozen=True)
class _Plan:
    """What an effect-free run needs, and no more: it may go to another process."""

    source: Experiment
    arm: SimulatedArm
    loop: tuple[Controller, Wire]
    windows: Windows
    kept: NDArray[np.int64]
    present: CurrentFit


_Draw = tuple[list[Array], np.random.Generator]
_Outcome = tuple[dict[str, float], float] | None


def _in_turn(
    run: Callable[[_Draw], _Outcome], draws: Sequence[_Draw], source: Experiment
) -> Iterator[_Outcome]:
    """All runs' outcomes in their order, in several processes where that pays."""
    workers = min(len(draws), os.cpu_count() or 1)
    if workers < 2 or sum(d.samples for d in source.datasets) < _WORTH_PROCESSES:
        return map(run, draws)
    return in_processes(run, draws, workers)


def _run(plan: _Plan, draw: _Draw) -> _Outcome:
    """Largest gain of each effect, and of nameless structure; None: the arm does not follow."""
    source, present, facts = plan.source, plan.present, plan.present.model.facts
    try:
        data = simulated_datasets(source, plan.arm, plan.loop, *draw)
    except DataError:
        return None
    parts = segments(data, plan.windows)
    simulated = windowed_rows(parts, plan.windows, facts, plan.kept, known_torque(source))
    now = nominal_fit(simulated, facts)
    if present.accepted:
        now = extend(simulated, now, present.accepted)
    _, scores = examine(simulated, now, all_hypotheses(now.model.facts))
    gains: dict[str, float] = {}
    for s in scores:
        small = all(
            abs(v) < c.min_size for v, c in zip(s.values, s.hypothesis.coefficients, strict=True)
        )
        if not small:
            effect = s.hypothesis.effect
            gains[effect] = max(gains.get(effect, 0.0), s.gain)
    table = build_design_matrix(simulated, now.model, now.accepted)
    transient = find_transient(simulated, table, now.fit, now.fit.choice)
    gains[CONTACT.id] = 0.0 if transient is None else transient.gain
    left = remaining_structures(simulated, now.model, table, now.fit)
    return gains, max((x.gain for x in left), default=0.0)


def _with_chance(
    threshold: Threshold, table: Table, present: CurrentFit, left: Sequence[Residual]
) -> Threshold:
    """What chance gives: the residual's spectrum with other phases, against all columns."""
    rng = np.random.default_rng(0)
    searched = np.isin(table.fold, SEARCHED)
    draws = []
    for r in left:
        if len(r.values) == 0:
            draws.append(np.zeros((0, _CHANCE_DRAWS)))
            continue
        drawn = np.column_stack([phase_randomised(r, rng) for _ in range(_CHANCE_DRAWS)])
        draws.append(drawn * searched[:, None])
    now = fit(table.grams.of(SEARCHED), present.fit.choice, present.fit.sigma)
    by_effect = noise_gains(table, now, draws, len(present.accepted))
    gain = dict(threshold.gain)
    for effect, values in by_effect.items():
        gain[effect] = max(gain.get(effect, 0.0), float(np.quantile(values, _CHANCE_QUANTILE)))
    return replace(threshold, gain=gain)


def _disturbance(
    rows: WindowedRows, left: Sequence[Residual], log: int, data: Dataset, rng: np.random.Generator
) -> Array:
    """Torque noise of the sliding residual's size and spectrum, at the log's rate, shape (S, n)."""
    samples = max(len(s.q) for s in data.segments)
    hop = rows.windows.hop
    count = samples // hop + 2
    noise = np.zeros((samples, len(left)))
    for j, r in enumerate(left):
        if len(r.values) == 0:
            continue
        series = phase_randomised(r, rng)
        repeated = np.resize(np.roll(series, int(rng.integers(len(series)))), count)
        noise[:, j] = np.interp(np.arange(samples) / hop, np.arange(count), repeated)
    return noise


def fit_all(table: Table, now: Fit) -> Fit:
    """The fit on all folds."""
    return fit(table.grams.of(range(FOLDS)), now.choice, now.sigma)
