"""The identified arm with its effects, as `model.yaml` keeps it."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ident.dynamics.base_parameters import base_map
from ident.dynamics.parameters import KIND_OF_TERM
from ident.effects.bound_effects import BoundEffects, members_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.compensation import without_effects
from ident.effects.reversal_friction import BASIS
from ident.estimation.regression_data import RegressionData, posture
from ident.estimation.reversal_shapes import KnownShapes
from ident.gap.data.experiment import Experiment, own_drives
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
    gains = source.arm.settings.gains_nm_per_a or ()
    if source.reference_model is not None:
        known = _of_today(source.reference_model, source, fitted, accepted)
        return replace(known, effects=effects, gains_nm_per_a=gains)
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
        gains_nm_per_a=gains,
        effects=effects,
    )


def _of_today(
    known: Model, source: Experiment, fitted: FeasibleModel, accepted: Sequence[Candidate]
) -> Model:
    """A reference model with these recordings' friction, which the search fits anew.

    Rotors and offsets of drives that an effect changes are changed with them.
    """
    delta, factors = known.delta.copy(), np.ones(known.robot.dof)
    for h, values in zip(accepted, fitted.effects, strict=True):
        for joint, factor in catalogue()[h.effect].drive_factors(h, values).items():
            factors[joint] *= factor
    motors = np.array([np.prod(factors[row]) for row in own_drives(known.terms)])
    friction = {"fv": fitted.viscous, "fc": fitted.coulomb}
    for i, p in enumerate(known.parameters):
        k = p.index - 1
        if p.kind in friction and known.moving[k]:
            delta[i] = friction[p.kind][k]
        elif p.kind in ("fo", "ia"):
            delta[i] *= (factors if p.kind == "fo" else motors)[k]
    base = base_map(known.robot, known.terms, [posture(d) for d in source.datasets])
    rows, beta = {b.name: b for b in known.base_parameters}, base.K @ delta
    table = tuple(
        replace(rows[name], values={known.estimator: float(value)})
        for name, value in zip(base.names, beta, strict=True)
        if name in rows
    )
    whole = len(table) == len(known.base_parameters) == len(base.names)
    return replace(known, delta=delta, base_parameters=table if whole else ())


def fitted_beside(
    model: Model, named: Collection[Place], data: Sequence[Dataset], arm: Arm
) -> tuple[Model, RegressionData]:
    """The arm as `ident run` fits it beside a model's effects, and what it was fitted to.

    Offsets and rotors are fitted as terms where the arm's settings, or the data, take the term for
    all joints. Those without a name are no effects any more; those with one stay effects, of the
    size that this fit gives them.

    Args:
        model: with the effects, which are taken off the torque first, and kept.
        named: effects that stay effects in any case.
        data: the recordings in the periods that count.
        arm: the robot and its settings.

    Raises:
        DataError: recordings from which nothing can be learned beside the effects.
    """
    effects = list(members_of(model))
    everything = set(range(len(effects)))
    kept = {i for i in everything if (effects[i][0].effect, effects[i][0].joints) in named}
    terms = [_usual_term(h, i in kept, arm) for i, (h, _) in enumerate(effects)]

    def beside(chosen: Collection[int], arm: Arm) -> tuple[Model, RegressionData]:
        carried = BoundEffects(tuple(m for i, m in enumerate(effects) if i in chosen))
        known = replace(model, effects=carried)
        found = identify([without_effects(known, d) for d in data], arm)
        return replace(model_of(found), effects=carried), found.evidence

    fitted, evidence = beside({i for i in everything if not terms[i]}, arm)
    taken = {i for i in everything if terms[i] in evidence.arm.settings.terms}
    if any(terms[i] for i in everything - taken):
        fitted, evidence = beside(everything - taken, evidence.arm)
    sized = taken & kept
    if not sized:
        return fitted, evidence
    for i in sized:
        h, _ = effects[i]
        effects[i] = (h, fitted.parameter(KIND_OF_TERM[terms[i]])[list(h.joints)])
    return beside(everything - (taken - sized), evidence.arm)


def _usual_term(h: Candidate, is_named: bool, arm: Arm) -> str:
    """The term that may hold an effect; a named one is another thing where motors are coupled."""
    drives, j = arm.terms.drive_matrix, h.joints[0]
    if is_named and np.count_nonzero(drives[j]) + np.count_nonzero(drives[:, j]) > 2:
        return ""
    return catalogue()[h.effect].usual_term


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
