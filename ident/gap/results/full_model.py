"""The identified arm with its effects, as `model.yaml` keeps it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.bound_effects import BoundEffects
from ident.effects.candidate import Candidate
from ident.effects.smoothed_segment import DIRECTION_HZ, MOTION_HZ
from ident.gap.data.experiment import Experiment
from ident.gap.data.windows import Windows
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.regression.weighted_fit import Fit
from ident.model.fit_filter import Filter
from ident.model.identified_model import BaseParameter, Model

Array = NDArray[np.floating]

_ORDER = 3


def model_with(
    source: Experiment,
    windows: Windows,
    fitted: FeasibleModel,
    fit: Fit,
    accepted: Sequence[Candidate],
    slow: Array,
) -> Model:
    """The physically possible arm with its effects, as `model.yaml` keeps it.

    Args:
        source: arm and recordings.
        windows: averaging windows of the fit.
        fitted: the physically possible parameters.
        fit: the unconstrained solution behind them.
        accepted: effects.
        slow: speed below which each joint counts as reversing [rad/s], shape (n,).
    """
    effects = BoundEffects(tuple(zip(accepted, fitted.effects, strict=True)))
    if source.reference_model is not None:
        return replace(source.reference_model, effects=effects)
    return Model(
        arm=source.arm.name,
        estimator="feasible",
        robot=source.arm.robot,
        terms=fitted.terms,
        delta=fitted.standard,
        moving=source.moving,
        base_parameters=_table(fitted),
        filter=Filter(
            cutoff_hz=windows.cutoff_hz,
            order=_ORDER,
            differentiation_cutoff_hz=MOTION_HZ,
            sign_cutoff_hz=DIRECTION_HZ[1],
            parallel=True,
            velocity_threshold_rad_s=float(slow[source.moving].max()),
        ),
        noise=_noise(source, fit),
        logs=tuple(d.name for d in source.datasets),
        effects=effects,
    )


def _table(fitted: FeasibleModel) -> tuple[BaseParameter, ...]:
    base = fitted.base
    beta = base.K @ fitted.standard
    return tuple(
        BaseParameter(name, unit, {"feasible": float(value)}, float(sd))
        for name, unit, value, sd in zip(base.names, base.units, beta, fitted.sd, strict=True)
    )


def _noise(source: Experiment, fit: Fit) -> Array:
    squares = (fit.sigma**2 * fit.counts).sum(axis=1) / np.maximum(fit.counts.sum(axis=1), 1)
    return np.where(source.moving, np.sqrt(squares), np.nan)
