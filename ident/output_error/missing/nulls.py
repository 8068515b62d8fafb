"""The fitted arm without effects, recorded again: how large gains chance alone brings."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, Prior, Setup, fit
from ident.output_error.missing.folds import Fold
from ident.output_error.missing.judging import block_errors, rms, typical
from ident.output_error.missing.kinds import EffectKind
from ident.output_error.missing.screening import promising
from ident.output_error.missing.trial import tried
from ident.signals.arrays import Array

_STEP_S = 0.001
_ROUNDS = 3
_MAD = 1.4826  # standard deviation of a normal distribution per median absolute deviation
_DIFFERENCED = np.sqrt(6.0)  # of the second difference of white noise


@dataclass(frozen=True)
class Nulls:
    """What effect-free simulations showed.

    Attributes:
        gain: largest held-out gain of each effect over joints and simulations, by name.
        floor: held-out rms of a model with nothing missing [rad], shape (n,).
        typical: the same of its typical block of time.
        runs: how many there were.
    """

    gain: dict[str, float]
    floor: Array
    typical: Array
    runs: int


def nulls(
    fold: Fold, base: Fit, prior: Prior, asked: dict[EffectKind, NDArray[np.bool_]],
    resolution: Array, runs: int, screen: float,
) -> Nulls:  # fmt: skip
    """Gains and errors of effect-free simulations.

    Args:
        fold: the recordings whose commands are simulated.
        base: the fitted arm without effects.
        prior: what is believed.
        asked: joints at which each effect is looked for.
        resolution: steps of the encoders [rad], shape (n,).
        runs: how many.
        screen: what an effect explains in first order at least, to be fitted.
    """
    noise = white_noise(fold.fitted, base.settings, resolution)
    largest, floors = dict.fromkeys((k.name for k in asked), 0.0), []
    for seed in range(max(runs, 1)):
        rng = np.random.default_rng(seed)
        made = Fold(*(_recorded(s, base.settings, noise, resolution, rng)
                      for s in (fold.fitted, fold.judged)))  # fmt: skip
        begun = fit(made.fitted, base.settings, base.free, prior, _ROUNDS)
        errors = block_errors(made.judged, begun.settings)
        floors.append((rms(errors), typical(errors)))
        worth = promising(made.fitted, begun, asked, screen) if runs else {}
        for kind, places in worth.items():
            if not places.any():
                continue
            found = tried(made, begun, errors, kind, places, prior, _ROUNDS)
            largest[kind.name] = max(largest[kind.name], float(found.gain.max()))
    floor, usual = np.mean(floors, axis=0)
    return Nulls(largest, floor, usual, runs)


def white_noise(setup: Setup, settings: Array, resolution: Array) -> Array:
    """Of the encoders beyond their steps, from second differences [rad], shape (n,)."""
    made = setup.replay(settings)
    bent = [np.diff((s.q - m)[s.counted :], 2, axis=0) for s, m in
            zip(setup.segments, made, strict=True)]  # fmt: skip
    size = _MAD * np.median(np.abs(np.concatenate(bent)), axis=0) / _DIFFERENCED
    return np.sqrt(np.maximum(size**2 - resolution**2 / 12.0, 0.0))


def _recorded(
    setup: Setup, settings: Array, noise: Array, resolution: Array, rng: np.random.Generator
) -> Setup:
    """The same commands as a simulated arm would have answered them."""
    segments = []
    fine = replace(setup, step=_STEP_S)
    for s, q in zip(setup.segments, fine.replay(settings), strict=True):
        told = q + noise * rng.standard_normal(q.shape)
        step = np.where(resolution > 0.0, resolution, 1.0)
        told = np.where(resolution > 0.0, np.round(told / step) * step, told)
        segments.append(replace(s, q=told, motion=s.motion._replace(start=told[0].copy())))
    return replace(setup, segments=tuple(segments))
