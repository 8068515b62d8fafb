"""Cable harness or return spring."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

_SOFT = 1e-9  # N m/rad


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
    loads_link = True
    compares = False
    freedom = FormUncertainty.POSITION
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
        columns = [q, np.ones_like(q)]
        if "rest" in hypothesis.settings:
            columns.append((q - hypothesis.settings["rest"]) ** 3)
        return np.stack(columns, axis=-1)[:, None, :]

    def bent(self, hypothesis: Hypothesis, values: Array) -> Hypothesis:
        """A spring that hardens or softens with the distance from where it rests."""
        harder = Coefficient("hardening", "N m/rad^3")
        rest = -float(values[1]) / max(float(values[0]), _SOFT)
        return replace(
            hypothesis,
            coefficients=(*hypothesis.coefficients, harder),
            settings={"rest": float(np.clip(rest, -np.pi, np.pi))},
        )

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A spring."""
        item = Term(_spring, hypothesis.joints[0], (values[0], values[1]))
        return replace(arm, terms=(*arm.terms, item))


EFFECT = JointSpring()
