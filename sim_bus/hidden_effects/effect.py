"""Base of the hidden effects: parameters from a file, and a change of the physics."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from sim_bus.plant.physics import Act, EncoderModel, Physics, StepState
from wamctl.arm.arrays import Array
from wamctl.arm.config import Section

Number = Annotated[float, Field(allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]


@dataclass(frozen=True)
class Elsewhere:
    """Marks sizes of joints; `value` is that of joints which an effect does not name."""

    value: float = 0.0


Sizes = Annotated[Number | tuple[Number, ...], Elsewhere()]
"""One number for all joints that an effect names, or one for each of them."""

PositiveSizes = Annotated[Positive | tuple[Positive, ...], Elsewhere()]
NotNegativeSizes = Annotated[NotNegative | tuple[NotNegative, ...], Elsewhere()]
JointNumbers = Annotated[
    tuple[Annotated[int, Field(ge=1)], ...],
    Field(min_length=1, description="which joints (or motors), counted from 1"),
]


class HiddenEffect(Section):
    """One hidden effect; most act at some joints, or on their motors."""

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The same arm with the effect in it; `seed` is for effects by chance."""
        raise NotImplementedError


class AtJoints(HiddenEffect):
    """An effect at some joints, or on some motors."""

    joints: JointNumbers

    def spread(
        self, sizes: float | tuple[float, ...], physics: Physics, elsewhere: float = 0.0
    ) -> Array:
        """Sizes at their joints, another value elsewhere, shape (n,).

        Raises:
            ValueError: a joint that the arm does not have, or a wrong number of sizes.
        """
        n = physics.dof
        strangers = [j for j in self.joints if j > n]
        if strangers:
            raise ValueError(f"joint {strangers[0]} of an arm with {n} joints")
        values = sizes if isinstance(sizes, tuple) else (sizes,) * len(self.joints)
        if len(values) != len(self.joints):
            raise ValueError(f"{len(values)} sizes for {len(self.joints)} joints")
        spread = np.full(n, elsewhere)
        spread[[j - 1 for j in self.joints]] = values
        return spread


class Acts(AtJoints):
    """An effect that has no memory, and needs no more than each step's state and its sizes."""

    at_motors: ClassVar[bool] = False
    """Whether it acts on the motors' torque, before that gets to the joints."""

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """What happens in each step; each size by its field's name, shape (n,)."""
        raise NotImplementedError

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The effect acts in each step."""
        sizes = {
            name: self.spread(getattr(self, name), physics, mark.value)
            for name, field in type(self).model_fields.items()
            for mark in field.metadata[-1:]
            if isinstance(mark, Elsewhere)
        }
        add = on_motors if self.at_motors else on_joints
        return add(physics, lambda state: self.act(state, sizes))


def on_motors(physics: Physics, act: Act) -> Physics:
    """The same arm, whose motors' torque meets one more effect."""
    return replace(physics, on_motors=(*physics.on_motors, act))


def on_joints(physics: Physics, act: Act) -> Physics:
    """The same arm with one more effect at its joints."""
    return replace(physics, on_joints=(*physics.on_joints, act))


def at_encoders(physics: Physics, model: EncoderModel) -> Physics:
    """The same arm, seen through one more effect."""
    return replace(physics, encoder_models=(*physics.encoder_models, model))
