"""Effects of what is fixed to the arm, of its base, and of what it touches."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from sim_bus.hidden_effects.effect import (
    Acts,
    Array,
    HiddenEffect,
    NotNegative,
    Number,
    Positive,
    Sizes,
)
from sim_bus.plant.physics import Physics, StepState

Point = tuple[Number, Number, Number]


class Payload(HiddenEffect):
    """A ball at the tool."""

    effect: Literal["payload"]
    kg: Positive
    at_m: Point = (0.0, 0.0, 0.05)
    radius_m: NotNegative = 0.03

    def hide(self, physics: Physics, seed: int) -> Physics:
        """Its centre is given in the parameter frame of the last link."""
        x, y, z = self.at_m
        own = 0.4 * self.radius_m**2
        ball = [y * y + z * z + own, -x * y, -x * z, x * x + z * z + own, -y * z]
        ball += [x * x + y * y + own, x, y, z, 1.0]
        delta = physics.truth.delta.copy()
        delta[-10:] += self.kg * np.array(ball)
        return replace(physics, truth=replace(physics.truth, delta=delta))


class GravityTilt(HiddenEffect):
    """A base that is not level."""

    effect: Literal["gravity_tilt"]
    x_rad: Number = 0.0
    y_rad: Number = 0.0

    def hide(self, physics: Physics, seed: int) -> Physics:
        """The base is turned about its own x axis, then about its own y axis."""
        about_x = _rotation(self.x_rad, 1, 2)
        about_y = _rotation(self.y_rad, 2, 0)
        return replace(physics, gravity_m_s2=(about_x @ about_y).T @ physics.gravity_m_s2)


def _rotation(angle: float, first: int, second: int) -> Array:
    """Turns axis `first` towards axis `second`, shape (3, 3)."""
    turn = np.eye(3)
    turn[first, first] = turn[second, second] = np.cos(angle)
    turn[second, first] = np.sin(angle)
    turn[first, second] = -turn[second, first]
    return turn


class JointSpring(Acts):
    """A cable harness or return spring, which pulls towards a rest angle."""

    effect: Literal["joint_spring"]
    nm_rad: Sizes
    rest_rad: Sizes = 0.0

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Torque -stiffness (q - rest)."""
        state.torque -= sizes["nm_rad"] * (state.q - sizes["rest_rad"])


class Contact(Acts):
    """A push during a stretch of time, that comes and goes smoothly."""

    effect: Literal["contact"]
    nm: Sizes
    from_s: NotNegative
    to_s: Positive

    def act(self, state: StepState, sizes: Mapping[str, Array]) -> None:
        """Torque nm sin^2 over the stretch; time counts from when the stand lets go."""
        share = (state.time_s - self.from_s) / (self.to_s - self.from_s)
        if 0.0 < share < 1.0:
            state.torque += sizes["nm"] * np.sin(np.pi * share) ** 2


Effects = Payload | GravityTilt | JointSpring | Contact
