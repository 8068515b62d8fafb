"""The identified arm with its effects, as `model.yaml` keeps it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.effects.bound_effects import BoundEffects
from ident.effects.candidate import Candidate
from ident.effects.reversal_friction import BASIS
from ident.estimation.reversal_shapes import KnownShapes
from ident.gap.data.experiment import Experiment
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.regression.weighted_fit import Fit
from ident.identification.validation import fit_filter
from ident.model.identified_model import Model
from ident.model.records import BaseParameter
from ident.regression.filters import processing
from ident.signals.arrays import Array


def model_with(
    source: Experiment,
    fitted: FeasibleModel,
    fit: Fit,
    accepted: Sequence[Candidate],
) -> Model:
    """The physically possible arm with its effects, as `model.yaml` keeps it.

    Its filter is that of `ident run`, so that their errors can be compared.

    Args:
        source: arm and recordings.
        fitted: the physically possible parameters.
        fit: the unconstrained solution behind them.
        accepted: effects.
    """
    effects = BoundEffects(tuple(zip(accepted, fitted.effects, strict=True)))
    if source.reference_model is not None:
        return replace(source.reference_model, effects=effects)
    process = processing(source.arm, source.datasets[0])
    return Model(
        arm=source.arm.name,
        estimator="feasible",
        robot=source.arm.robot,
        terms=fitted.terms,
        delta=fitted.standard,
        moving=source.moving,
        base_parameters=_table(fitted),
        filter=fit_filter(process, KnownShapes(BASIS, fit.structure.shapes)),
        noise=_noise(source, fit),
        logs=tuple(d.name for d in source.datasets),
        gains_nm_per_a=source.arm.settings.gains_nm_per_a or (),
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
