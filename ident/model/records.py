"""Rows of `model.yaml`: base parameters and effects."""

from dataclasses import dataclass
from typing import Any

from pydantic import Field

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
