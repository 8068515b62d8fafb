"""The fitted arm without effects, recorded again: how large gains chance alone brings."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import left_out, rms, typical
from ident.output_error.search.parts import Part
from ident.output_error.search.screening import promising
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import trials
from ident.output_error.setup import Prior, Setup
from ident.regression.progress import silent
from ident.signals.arrays import Array

_STEP_S = 0.001
_ROUNDS = 3
_MAD = 1.4826  # standard deviation of a normal distribution per median absolute deviation
_DIFFERENCED = np.sqrt(6.0)  # of the second difference of white noise


@dataclass(frozen=True)
class Nulls:
    """What effect-free simulations showed.

    Attributes:
        gain: largest held-out gain of each effect over joints and simulations.
        floor: held-out rms of a model with nothing missing [rad], shape (n,).
        typical: the same of its typical block of time.
        runs: how many there were.
    """

    gain: dict[Part, float]
    floor: Array
    typical: Array
    runs: int


def nulls(
    setup: Setup, base: Fit, prior: Prior, asked: dict[Part, NDArray[np.bool_]],
    settings: SearchSettings,
) -> Nulls:  # fmt: skip
    """Gains and errors of effect-free simulations.

    Args:
        setup: the recordings whose commands are simulated.
        base: the fitted arm without effects.
        prior: what is believed.
        asked: joints at which each effect is looked for.
        settings: numbers that decide, also how many runs.
    """
    noise = white_noise(setup, base.settings)
    largest, floors = dict.fromkeys(asked, 0.0), []
    for seed in range(max(settings.null_runs, 1)):
        rng = np.random.default_rng(seed)
        made = _recorded(setup, base.settings, noise, rng)
        begun = fit(made, base.settings, base.free, prior, _ROUNDS)
        errors = left_out(made, begun, prior)
        floors.append((rms(errors), typical(errors)))
        if settings.null_runs:
            worth = promising(made, begun, asked, settings)
            args = made, begun, errors, worth, prior, replace(settings, fit_rounds=_ROUNDS), silent
            for trial in trials(*args):
                largest[trial.part] = max(largest[trial.part], float(trial.gain.max()))
    floor, usual = np.mean(floors, axis=0)
    return Nulls(largest, floor, usual, settings.null_runs)


def white_noise(setup: Setup, settings: Array) -> Array:
    """Of the encoders beyond their steps, from second differences [rad], shape (n,)."""
    made = setup.replay(settings)
    bent = [np.diff((s.q - m)[s.counted :], 2, axis=0) for s, m in
            zip(setup.segments, made, strict=True)]  # fmt: skip
    size = _MAD * np.median(np.abs(np.concatenate(bent)), axis=0) / _DIFFERENCED
    return np.sqrt(np.maximum(size**2 - setup.resolution**2 / 12.0, 0.0))


def _recorded(setup: Setup, settings: Array, noise: Array, rng: np.random.Generator) -> Setup:
    """The same commands as a simulated arm would have answered them."""
    segments, resolution = [], setup.resolution
    fine = replace(setup, step=_STEP_S)
    for s, q in zip(setup.segments, fine.replay(settings), strict=True):
        told = q + noise * rng.standard_normal(q.shape)
        step = np.where(resolution > 0.0, resolution, 1.0)
        told = np.where(resolution > 0.0, np.round(told / step) * step, told)
        segments.append(replace(s, q=told, motion=s.motion._replace(start=told[0].copy())))
    return replace(setup, segments=tuple(segments))
