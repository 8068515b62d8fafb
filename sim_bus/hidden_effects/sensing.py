"""Effects between the joints and the programs that read their positions."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from sim_bus.hidden_effects.effect import Array, AtJoints, HiddenEffect, Sizes, at_encoders
from sim_bus.plant.physics import Physics, StepState


class EncoderOffset(AtJoints):
    """A joint's zero that is not where the configuration has it."""

    effect: Literal["encoder_offset"]
    rad: Sizes

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The encoders show the true angle and the offset."""
        offset = self.spread(self.rad, physics)
        return at_encoders(physics, lambda q, state: q + offset)


class DroppedSamples(HiddenEffect):
    """A data fault: now and then all positions are those of the reading before, or of several."""

    effect: Literal["dropped_samples"]
    share: Annotated[float, Field(gt=0, lt=1, description="of all readings")]
    length: Annotated[int, Field(ge=1, description="readings in a row")] = 1

    def hide(self, physics: Physics, seed: int) -> Physics:
        """By chance, from the seed."""
        random = np.random.default_rng([seed, 0xD])
        last = np.zeros(physics.dof)
        left = np.zeros(1, dtype=np.int64)

        def reading(q: Array, state: StepState) -> Array:
            if left[0] == 0 and state.time_s > 0.0 and random.random() < self.share / self.length:
                left[0] = self.length
            if left[0] > 0:
                left[0] -= 1
                return last.copy()
            last[:] = q
            return q

        return at_encoders(physics, reading)


Effects = EncoderOffset | DroppedSamples
