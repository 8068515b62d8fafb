"""A base that is not level."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import ArmFacts, Array, Coefficient, Hypothesis, Observed
from ident.simulation.arm import SimulatedArm
from ident.simulation.chain import torques


class GravityTilt:
    """Gravity turned about the base's x and y axes."""

    id = "gravity_tilt"
    title = "a base that is not level"
    equation = "g = R_x(a) R_y(b) g_0, to first order in the tilt angles a, b"
    source = "the gravity term of (1), differentiated by the direction of gravity"
    signature = (
        "gravity torque where a level base has none: at joint 1, as sin and cos of its angle"
    )
    rivals = ("encoder_offset", "torque_offset")
    contains = ()
    experiment = "turn joint 1 through more than 180 degrees with the arm stretched out level"
    compares = False
    exact = True
    smooth = True
    uses = ("model",)
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One: all joints feel it."""
        joints = tuple(range(arm.dof))
        bound = 0.35
        angles = tuple(Coefficient(f"tilt_{s}", "rad", -bound, bound) for s in _axes(arm))
        return [Hypothesis(self.id, joints, joints, angles)]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the gravity torque per tilt angle."""
        rest = np.zeros_like(seen.q)
        chain = seen.arm.chain
        columns = []
        for axis in _axes(seen.arm):
            turned = np.cross(np.eye(3)["xyz".index(axis)], chain.gravity)
            tilted = chain._replace(gravity=np.ascontiguousarray(turned))
            columns.append(torques(tilted, seen.arm.delta, seen.q, rest, rest))
        return np.stack(columns, axis=-1)

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """Gravity in another direction."""
        angle = np.zeros(3)
        for coefficient, value in zip(hypothesis.coefficients, values, strict=True):
            angle["xyz".index(coefficient.name[-1])] = value
        gravity = arm.chain.gravity + np.cross(angle, arm.chain.gravity)
        gravity *= np.linalg.norm(arm.chain.gravity) / np.linalg.norm(gravity)
        return replace(arm, chain=arm.chain._replace(gravity=gravity))


def _axes(arm: ArmFacts) -> str:
    """The two base axes that are not along gravity."""
    along = int(np.abs(arm.chain.gravity).argmax())
    return "".join(s for i, s in enumerate("xyz") if i != along)


EFFECT = GravityTilt()
