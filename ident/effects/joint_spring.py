"""Cable harness or return spring."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import ArmFacts, Array, Coefficient, Freedom, Hypothesis, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _spring(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0] * q[joint] + settings[1]


class JointSpring:
    """tau = .. + k (q - q0)."""

    id = "joint_spring"
    title = "a spring on the joint, such as a cable bundle that is bent"
    equation = "tau_j += k q_j + c"
    source = "Hooke's law about a rest position -c/k"
    signature = "grows with the joint's angle, the same in both directions"
    rivals = ("torque_offset", "gravity_tilt", "encoder_offset")
    contains = ("torque_offset",)
    experiment = "move the joint alone over more than 2 rad, slowly, in several poses of the others"
    compares = False
    freedom = Freedom.POSITION
    smooth = True
    uses = ()
    settings = ()

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint."""
        both = (
            Coefficient("stiffness", "N m/rad", lower=0.0, essential=True),
            Coefficient("torque_at_zero", "N m"),
        )
        return [Hypothesis(self.id, (j,), (j,), both) for j in arm.moving_joints]

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """The joint's angle, and ones."""
        q = seen.q[:, hypothesis.joints[0]]
        return np.stack([q, np.ones_like(q)], axis=-1)[:, None, :]

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A spring."""
        item = Term(_spring, hypothesis.joints[0], (values[0], values[1]))
        return replace(arm, terms=(*arm.terms, item))


EFFECT = JointSpring()
