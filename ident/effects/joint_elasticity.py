"""A transmission that gives."""

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.motor_link import LIGHT, Transmission, mass_in
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm

_SWINGS_HZ = (6.0, 12.0, 40.0)  # of a link whose motor is held; softer is a lag by another name
_MOTOR = 0.1  # of the joint's inertia: a motor's; it hardly matters


class JointElasticity:
    """tau_link = K (q_motor - q_link)."""

    id = "joint_elasticity"
    title = "a transmission that gives under load"
    equation = "tau_link,j = K (q_j - q_link,j)"
    source = "Spong 1987, eq. (6)"
    signature = "gravity and inertia as if the pose were another, in step with the joint's own load"
    rivals = ("encoder_offset", "torque_delay", "rotor_inertia")
    contains = ()
    experiment = "a chirp up to 50 Hz; an encoder on the joint's side"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = True
    uses = ("model", "friction")
    twice = ("compliance", "give")
    settings = (
        Setting("give", "rad/(N m)", (1e-4, 4e-4, 1.6e-3), 1e-7, 1.0, reported=False),
        Setting("rubbing", "1", (0.0, 0.5, 1.0), 0.0, 1.0, even=True, late=True, reported=False),
        Setting("damped", "1", (0.1, 0.4), 0.01, 0.4, late=True, reported=False),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each joint and frequency at which its link swings; all torques change."""
        rows, mass = tuple(range(arm.dof)), np.diag(mass_in(arm.pose, arm.chain, arm.delta))
        coefficient = (Coefficient("compliance", "rad/(N m)", lower=0.0),)
        give, rubbing, damped = self.settings
        found = []
        for j in arm.moving_joints:
            inertia = max(float(mass[j]), LIGHT)
            for swing in _SWINGS_HZ:
                softness = 1.0 / (inertia * (2 * np.pi * swing) ** 2)
                shape = {give.name: softness, rubbing.name: 0.0, damped.name: damped.grid[-1]}
                shape["motor_inertia"] = _MOTOR * inertia
                found.append(Hypothesis(self.id, (j,), rows, coefficient, shape))
        return found

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Change of the torque with the link's swing, per compliance."""
        give = hypothesis.settings["give"]
        return _tie(hypothesis, give).change(seen, hypothesis.joints[0])[:, :, None] / give

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A motor of its own, with the encoder, on a spring."""
        return _tie(hypothesis, float(values[0])).between(arm, hypothesis.joints[0])


def _tie(hypothesis: Hypothesis, give: float) -> Transmission:
    shape = hypothesis.settings
    return Transmission(np.inf, give, shape["damped"], shape["rubbing"], shape["motor_inertia"])


EFFECT = JointElasticity()
