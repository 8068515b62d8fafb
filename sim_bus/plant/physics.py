"""Parts of one arm's physics beside its robot model."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sim_bus.plant.truth import Truth
from wamctl.arm.arrays import Array


@dataclass
class StepState:
    """The middle of one inner step, which effects look at and change; n joints.

    Attributes:
        time_s: since the stand let go of the arm [s].
        step_s: length of the inner step [s].
        q: joint positions [rad], shape (n,).
        qd: joint velocities [rad/s], shape (n,).
        motor: torque that the motors make [N m], motor side, shape (n,); effects may change it.
        load: that torque at the joints [N m], shape (n,).
        torque: further torque on the joints [N m], shape (n,); effects add to it.
        drag: further viscous coefficient [N m s/rad], shape (n,); effects add to it.
        bounds: least and greatest torque of each dry friction [N m], shape (2, n + k); effects
            change it.
    """

    time_s: float
    step_s: float
    q: Array
    qd: Array
    motor: Array
    load: Array
    torque: Array
    drag: Array
    bounds: Array

    def widen(self, torque: Array) -> None:
        """More dry friction at the joints [N m], shape (n,)."""
        self.bounds[:, : len(torque)] += [-torque, torque]


Act = Callable[[StepState], None]
"""A hidden effect's action in every inner step."""

EncoderModel = Callable[[Array, StepState], Array]
"""Joint positions as the motors' encoders show them, from the true ones [rad], shape (n,)."""


@dataclass(frozen=True)
class Physics:
    """The arm as it is; n joints.

    Attributes:
        truth: inertial parameters, friction and transmission.
        gravity_m_s2: in the base frame [m/s^2], shape (3,).
        armature: inertia at the joints beside that of links and rotors [kg m^2], shape (n, n).
        drag: viscous matrix beside that of the truth [N m s/rad], shape (n, n).
        slides: further dry frictions as sliding speeds from joint speeds, shape (k, n).
        slide_torque: their torques [N m], shape (k,).
        on_motors: what happens between the drives' torques and the joints, in this order.
        on_joints: what happens at the joints, in this order.
        encoder_models: what happens between the joints and the encoders, in this order.
    """

    truth: Truth
    gravity_m_s2: Array
    armature: Array
    drag: Array
    slides: Array
    slide_torque: Array
    on_motors: tuple[Act, ...] = ()
    on_joints: tuple[Act, ...] = ()
    encoder_models: tuple[EncoderModel, ...] = field(default=())

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.truth.coulomb)


def plain_physics(truth: Truth, gravity_m_s2: Array) -> Physics:
    """An arm without any effect beside its truth."""
    n = len(truth.coulomb)
    nothing = np.zeros((n, n))
    return Physics(truth, gravity_m_s2, nothing, nothing, np.empty((0, n)), np.empty(0))
