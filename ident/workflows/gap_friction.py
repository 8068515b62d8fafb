"""How friction differs from that of a reference model, beside which a search fits it anew."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ident.dynamics.parameters import of_joint
from ident.effects.bound_effects import members_of
from ident.effects.catalogue import catalogue
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from ident.workflows.model_errors import errors_on

_KINDS = {"coulomb": ("fc", "N m"), "viscous": ("fv", "N m s/rad")}
"""Friction's parameters, with the kind of their entries in delta."""

_WORSE = 1.25
"""Times a joint's error, from which the reference model's friction is told as another one."""

_LEAST = 2.0
"""What the change of friction makes of a joint's torque, at least, to be told [%]."""


def friction_content(
    model: Model, reference: Model | None, data: Sequence[Dataset]
) -> dict[str, Any]:
    """`friction` of `gap.json`: joints at which that of the reference model leaves clearly more.

    Nothing where there is no reference model, or no such joint. What a named effect changes of
    friction is that effect's.

    Args:
        model: the reference model with these recordings' friction and with the effects.
        reference: as it was.
        data: the recordings.
    """
    if reference is None:
        return {}
    before = _with_friction_of(model, reference)
    now, was = (_by_joint(m, data) for m in (model, before))
    if now is None or was is None:
        return {}
    changed = (was > _WORSE * now) & (np.sqrt(np.maximum(was**2 - now**2, 0.0)) > _LEAST)
    entries = [
        {
            "joints": [int(j) + 1],
            "parameters": {
                name: {
                    "value": float(model.parameter(kind)[j]),
                    "reference": float(before.parameter(kind)[j]),
                    "unit": of_joint(unit, bool(model.robot.sliding[j])),
                }
                for name, (kind, unit) in _KINDS.items()
            },
            "relative_error_percent": {"value": float(now[j]), "reference": float(was[j])},
        }
        for j in np.flatnonzero(changed)
    ]
    return {"friction": entries} if entries else {}


def _with_friction_of(model: Model, reference: Model) -> Model:
    """The model with the reference's friction, as far as no effect changes the drive's torque."""
    factors = np.ones(model.robot.dof)
    for h, values in members_of(model):
        for joint, factor in catalogue()[h.effect].drive_factors(h, values).items():
            factors[joint] *= factor
    delta = model.delta.copy()
    for i, p in enumerate(model.parameters):
        if p.kind in ("fv", "fc"):
            delta[i] = reference.delta[i] * factors[p.index - 1]
    return replace(model, delta=delta, base_parameters=())


def _by_joint(model: Model, data: Sequence[Dataset]) -> Array | None:
    """Relative errors of each joint over all recordings [%], shape (n,); NaN at held joints."""
    told = [e["relative_error_percent_by_joint"] for e in errors_on(model, data)]
    if not told:
        return None
    by_log = np.array([[np.nan if x is None else x for x in one] for one in told])
    return np.sqrt(np.mean(by_log**2, axis=0))
