"""Calibrate the thresholds: gains that the identical search finds where no effect is.

A parametric bootstrap: the fitted arm is simulated without further effects and searched, and again
with friction that turns round in other ways. Noise with the residual's spectrum and random phases
adds what chance gives.
"""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.effects.events import CONTACT
from ident.gap.data.blocks import SEARCHED, blocks_of
from ident.gap.data.experiment import Experiment, controller_of, wire_of
from ident.gap.data.reference_model import reference_torque
from ident.gap.data.windows import Windows
from ident.gap.lack_of_fit.remaining_structure import remaining_structures, structureless_noise
from ident.gap.nulls.foreign_reversals import with_foreign_reversals
from ident.gap.nulls.null_arms import (
    can_simulate,
    null_arm,
    phase_randomised,
    simulated_datasets,
)
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, extend, nominal_fit
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.rows import WindowedRows, windowed_rows
from ident.gap.regression.weighted_fit import fit
from ident.gap.selection.candidates import all_candidates, examine
from ident.gap.selection.scoring import is_too_small, noise_gains
from ident.gap.selection.state import SelectionState
from ident.gap.selection.thresholds import Threshold
from ident.gap.settings import GapSettings
from ident.gap.transients.detect import find_transient
from ident.recordings.dataset import Dataset
from ident.regression.processes import in_processes
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm
from ident.simulation.loop import Controller, Wire
from wamctl.arm.errors import DataError

Tell = Callable[[str], None]

_WORTH_PROCESSES = 40_000  # samples: fewer are searched before another process has started


def calibrated(
    source: Experiment, state: SelectionState, larger: CurrentFit, options: Options, tell: Tell
) -> Threshold:
    """The state's threshold with effect-free runs of its current model behind it.

    The noise is the residual of the larger model: it is the same if the effects in question are
    none. Without a known controller and reference, they are redrawn from the
    rows, not simulated.

    Args:
        source: the recordings.
        state: of the search.
        larger: the current model with the effects in question.
        options: of the search; the seed moves on with each calibration.
        tell: is told the progress.
    """
    threshold = _above_chance(state, larger, options.settings)
    threshold = _above_reversals(state, threshold, larger, options, tell)
    loop = controller_of(source), wire_of(source)
    if options.null_runs == 0 or loop[0] is None or loop[1] is None or not can_simulate(source):
        return threshold
    rows, current = state.rows, state.current
    left = structureless_noise(rows, larger, options.settings.effect_free_data)
    arm = null_arm(
        source, feasible_fit(source, current.fit, len(rows.base_parameters)), current.accepted
    )
    plan = _Plan(
        source,
        arm,
        (loop[0], loop[1]),
        rows.windows,
        rows.base_parameters,
        current,
        options.settings,
    )
    draws = []
    for draw in range(options.null_runs):
        rng = np.random.default_rng(options.seed + 100 * state.calibrations + draw)
        noises = [_disturbance(rows, left, d, rng) for d in source.datasets]
        draws.append((noises, rng))
    tell(f"simulating {options.null_runs} effect-free runs")
    found = []
    for done, outcome in enumerate(_in_turn(partial(_run, plan), draws, source)):
        tell(f"effect-free run {done + 1} of {options.null_runs} searched")
        if outcome is not None:
            found.append(outcome)
    factor = options.settings.thresholds.safety_factor
    return threshold.raised([g for g, _ in found], [most for _, most in found], factor)


@dataclass(frozen=True)
class _Plan:
    """All that an effect-free run needs; it may go to another process."""

    source: Experiment
    arm: SimulatedArm
    loop: tuple[Controller, Wire]
    windows: Windows
    base_parameters: NDArray[np.int64]
    current: CurrentFit
    settings: GapSettings


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
    """Largest gain of each effect, and of structure; None if the arm does not follow."""
    source, settings, facts = plan.source, plan.settings, plan.current.model.facts
    try:
        longest = settings.effect_free_data.presliding_rad
        data = simulated_datasets(source, plan.arm, plan.loop, *draw, longest)
    except DataError:
        return None
    blocks = blocks_of(data, plan.windows)
    rows = windowed_rows(blocks, facts, plan.base_parameters, reference_torque(source))
    now, gains = _searched(rows, plan.current, settings)
    left = remaining_structures(rows, now, settings.lack_of_fit)
    return gains, max((x.gain for x in left), default=0.0)


def _searched(
    rows: WindowedRows, current: CurrentFit, settings: GapSettings
) -> tuple[CurrentFit, dict[str, float]]:
    """The model fitted to rows without further effects, and the largest gain of each effect."""
    now = nominal_fit(rows, current.model.facts)
    if current.accepted:
        now = extend(rows, now, current.accepted)
    _, scores = examine(rows, now, all_candidates(now.model.facts), settings.scoring)
    gains: dict[str, float] = {}
    for s in scores:
        if not is_too_small(s):
            gains[s.candidate.effect] = max(gains.get(s.candidate.effect, 0.0), s.gain)
    transient = find_transient(rows, now, settings.transients)
    gains[CONTACT.id] = 0.0 if transient is None else transient.gain
    return now, gains


def _above_chance(state: SelectionState, larger: CurrentFit, settings: GapSettings) -> Threshold:
    """The threshold raised to the gains that all columns have on noise with random phases."""
    current = state.current
    design = current.design(state.rows, all_candidates(current.model.facts))
    left = residuals(larger.design(state.rows), larger.fit)
    rng = np.random.default_rng(0)
    searched = np.isin(design.fold, SEARCHED)
    count = settings.effect_free_data.chance_draws
    draws = []
    for r in left:
        if len(r.values) == 0:
            draws.append(np.zeros((0, count)))
            continue
        drawn = np.column_stack([phase_randomised(r, rng) for _ in range(count)])
        draws.append(drawn * searched[:, None])
    now = fit(design.equations.of(SEARCHED), current.fit.structure, current.fit.sigma)
    gain = dict(state.threshold.gain)
    for effect, values in noise_gains(design, now, draws).items():
        chance = float(np.quantile(values, settings.thresholds.chance_quantile))
        gain[effect] = max(gain[effect], chance)
    return replace(state.threshold, gain=gain)


def _above_reversals(
    state: SelectionState, threshold: Threshold, larger: CurrentFit, options: Options, tell: Tell
) -> Threshold:
    """The threshold raised by arms whose friction turns round in other ways than any fitted one."""
    draws = math.ceil(options.null_runs / 2)
    found = []
    for draw in range(draws):
        tell(f"searching arms that turn round in another way, {draw + 1} of {draws}")
        rng = np.random.default_rng([options.seed, state.calibrations, draw])
        rows = with_foreign_reversals(state.rows, state.current, larger, options.settings, rng)
        found.append(_searched(rows, state.current, options.settings)[1])
    return threshold.raised(found, [], options.settings.thresholds.safety_factor)


def _disturbance(
    rows: WindowedRows, left: Sequence[Residual], data: Dataset, rng: np.random.Generator
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
