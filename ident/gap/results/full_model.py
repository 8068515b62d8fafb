"""The identified arm with its effects, as `model.yaml` keeps it."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ident.effects.bound_effects import BoundEffects, members_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.compensation import without_effects
from ident.effects.reversal_friction import BASIS
from ident.estimation.reversal_shapes import KnownShapes
from ident.gap.data.experiment import Experiment
from ident.gap.regression.feasible_fit import FeasibleModel
from ident.gap.regression.weighted_fit import Fit
from ident.gap.selection.state import Place
from ident.identification.identify import identify, model_of
from ident.identification.validation import fit_filter
from ident.model.arm import Arm
from ident.model.identified_model import Model
from ident.model.records import BaseParameter
from ident.recordings.dataset import Dataset
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


def fitted_beside(
    model: Model, named: Collection[Place], data: Sequence[Dataset], arm: Arm
) -> Model:
    """The arm as `ident run` fits it beside a model's effects.

    Offsets and rotors without a name are no effects any more where the arm's settings take the
    term for all joints.

    Args:
        model: with the effects, which are taken off the torque first, and kept.
        named: effects that stay effects in any case.
        data: the recordings in the periods that count.
        arm: the robot and its settings.

    Raises:
        DataError: recordings from which nothing can be learned beside the effects.
    """
    members = members_of(model)
    kept = [m for m in members if not _is_spare(m[0], named)]
    spare = [m for m in members if _is_spare(m[0], named)]
    while True:
        known = replace(model, effects=BoundEffects(tuple(kept)))
        found = identify([without_effects(known, d) for d in data], arm)
        arm = found.evidence.arm
        left = [m for m in spare if catalogue()[m[0].effect].usual_term not in arm.settings.terms]
        if not left:
            return replace(model_of(found), effects=known.effects)
        kept, spare = [*kept, *left], []


def _is_spare(h: Candidate, named: Collection[Place]) -> bool:
    return bool(catalogue()[h.effect].usual_term) and (h.effect, h.joints) not in named


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
