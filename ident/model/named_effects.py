"""Effects in a model: what `model.yaml` says of them, and the torque that they add."""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from pydantic import Field

from ident.dynamics.regressor import Motion
from ident.signals.arrays import Array
from wamctl.arm.config import Section

if TYPE_CHECKING:
    from ident.model.identified_model import Model


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


class ModelEffects(Protocol):
    """The effects of a model, with their equations."""

    @property
    def records(self) -> tuple[EffectRecord, ...]:
        """The effects as `model.yaml` holds them."""
        ...

    def torque(self, model: "Model", motion: Motion, period_s: float | None) -> Array:
        """Torque beside the rigid bodies and their friction [N m], shape (S, n).

        Args:
            model: the arm that has the effects.
            motion: S samples.
            period_s: between the samples, which then follow each other; None: each stands alone.
        """
        ...


class NoEffects:
    """A model without named effects."""

    @property
    def records(self) -> tuple[EffectRecord, ...]:
        """None."""
        return ()

    def torque(self, model: "Model", motion: Motion, period_s: float | None) -> Array:
        """Zeros."""
        return np.zeros_like(motion.q)
