"""Rows of `model.yaml`: base parameters and effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ident.dynamics.parameters import Parameter, of_joint
from ident.signals.arrays import Array
from wamctl.arm.config import Section


@dataclass(frozen=True)
class BaseParameter:
    """A row of the arm's Table I.

    Attributes:
        name: the combination.
        unit: its SI unit.
        values: by estimator; CAD knows no friction.
        sd: standard error of the OLS value.
    """

    name: str
    unit: str
    values: dict[str, float]
    sd: float


class EffectRecord(Section):
    """An effect as `model.yaml` holds it.

    Attributes:
        name: id of the effect.
        joints: the joints named, from 1.
        equation: added to the joint torque.
        variant: which of the effect's forms it is.
        parameters: the numbers that it is linear in, by name.
        units: of these.
        settings: what shapes it, by name.
        rows: the joints whose torque changes, from 1.
    """

    name: str
    joints: tuple[int, ...]
    equation: str = ""
    variant: str = ""
    parameters: dict[str, float]
    units: dict[str, str] = Field(default={})
    settings: dict[str, Any] = Field(default={})
    rows: tuple[int, ...]

    def content(self, sliding: Sequence[bool]) -> dict[str, Any]:
        """What `model.yaml` holds, in N and m where the one joint named slides."""
        slides = len(self.joints) == 1 and sliding[self.joints[0] - 1]
        units = {name: of_joint(unit, slides) for name, unit in self.units.items()}
        return self.model_dump(mode="json") | {"units": units}


def errors_content(parameters: Sequence[Parameter], errors: Array) -> dict[str, Any]:
    """What `model.yaml` holds of the errors of delta: rows of a triangle by parameter.

    Args:
        parameters: the entries of delta.
        errors: shape (p, k); no columns where they are not known.
    """
    rows = {
        p.name: [float(f"{x:.4g}") for x in np.trim_zeros(row, "b")]
        for p, row in zip(parameters, errors, strict=False)
        if row.any()
    }
    return {"errors": rows} if rows else {}


def undetermined_links(parameters: Sequence[Parameter], errors: Array) -> NDArray[np.intp]:
    """Places among the links' parameters of those whose errors are infinite."""
    links = [
        bool(np.isinf(row).any())
        for p, row in zip(parameters, errors, strict=False)
        if p.kind == "inertial"
    ]
    return np.flatnonzero(links)


def errors_from(parameters: Sequence[Parameter], rows: Mapping[str, Sequence[float]]) -> Array:
    """The errors of delta, shape (p, k), from the rows of `model.yaml`."""
    columns = max(map(len, rows.values()), default=0)
    found = np.zeros((len(parameters), columns))
    for row, p in zip(found, parameters, strict=True):
        known = rows.get(p.name, ())
        row[: len(known)] = known
    return found
