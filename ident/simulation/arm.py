"""An arm to be simulated: the identified model, actuators, sensors, and effects added to it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numba import types
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

_VECTOR = types.Array(types.float64, 1, "C")
TERM = types.void(types.float64, _VECTOR, _VECTOR, _VECTOR, types.int64, _VECTOR, _VECTOR, _VECTOR)
"""Signature of a term: (t, q, qd, load, joint, settings, resistance, level)."""

SETTINGS = 8
"""A term has at most this many settings."""


def term(function: Callable[..., None]) -> Callable[..., None]:
    """Compile a torque of an effect for the simulation's inner loop.

    The function gets time [s], joint position [rad], velocity [rad/s], rigid-body torque [N m]
    (each of shape (n,)), the joint (from 0) and the settings; it adds to `resistance` [N m], which
    the drives must overcome beside the rigid-body torque, or to `level`, the size of the joints'
    Coulomb friction [N m].
    """
    return compiled(TERM)(function)


@dataclass(frozen=True)
class Term:
    """One torque of an effect on one joint.

    Attributes:
        function: compiled by `term`.
        joint: the joint, from 0.
        settings: numbers for the function.
        text: the same for exports, by joint (from 0): expressions of C and Python alike in `q`,
            `qd`, `load` and `held` (rigid-body torque, and that at rest), with `sgn`, `step`,
            `fabs`, `floor`, `pow`, `exp`, `sin` and `cos`; empty: it hangs on more than these.
    """

    function: Callable[..., None]
    joint: int
    settings: tuple[float, ...]
    text: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class SimulatedArm:
    """All that decides how torque commands turn into encoder readings.

    Attributes:
        chain: kinematics and gravity.
        delta: inertial parameters in the order of (8), shape (10 n,).
        armature: added to the mass matrix [kg m^2], shape (n, n).
        viscous: joint friction [N m s/rad], shape (n,).
        friction_rows: speed of each Coulomb element from the joints' speeds, shape (m, n); the
            first n are the joints themselves.
        coulomb: level of each element [N m], shape (m,).
        bristle: presliding distance of each element [rad], shape (m,); 0 sticks rigidly.
        gain: torques that act per torques of the drives, shape (n, n).
        limit: the drives clip the commanded joint torque here [N m], shape (n,).
        delay_s: the command acts later by this much [s], shape (n,).
        encoder_zero: encoders read the joint's position less this [rad], shape (n,).
        motor: inertia of a motor that moves beside its joint and carries the encoder, on the
            joint's side, a part of the joint's [kg m^2], shape (n,); 0: it moves as the joint.
        backlash: half the play between such a motor and its joint [rad], shape (n,).
        compliance: of what ties them beyond the play [rad/(N m)], shape (n,).
        damping: of that per its stiffness [s], shape (n,).
        link_friction_share: part of the friction of such a joint that acts on its link, not its
            motor, shape (n,).
        terms: further torques.
    """

    chain: Chain
    delta: Array
    armature: Array
    viscous: Array
    friction_rows: Array
    coulomb: Array
    bristle: Array
    gain: Array
    limit: Array
    delay_s: Array
    encoder_zero: Array
    motor: Array
    backlash: Array
    compliance: Array
    damping: Array
    link_friction_share: Array
    terms: tuple[Term, ...] = field(default=())

    @property
    def two_mass_joints(self) -> NDArray[np.int64]:
        """The joints, from 0, with a motor that moves beside them."""
        return np.flatnonzero(self.motor > 0.0)

    def with_terms(self, *terms: Term) -> "SimulatedArm":
        """The arm with further torques."""
        return replace(self, terms=(*self.terms, *terms))

    @property
    def motor_index(self) -> NDArray[np.int64]:
        """The coordinate of each joint's motor: after the joints' for two-mass joints."""
        index, loose = np.arange(len(self.backlash)), self.two_mass_joints
        index[loose] = len(index) + np.arange(len(loose))
        return index

    @property
    def on_motor(self) -> Array:
        """Part of each joint's friction that acts on its motor, shape (n,)."""
        return np.where(self.motor > 0.0, 1.0 - self.link_friction_share, 1.0)

    @property
    def drag(self) -> Array:
        """Viscous friction of each coordinate [N m s/rad]."""
        drag = np.zeros(len(self.backlash) + len(self.two_mass_joints))
        drag[: len(self.backlash)] = self.viscous * (1.0 - self.on_motor)
        drag[self.motor_index] += self.viscous * self.on_motor
        return drag

    @property
    def coulomb_elements(self) -> tuple[Array, Array]:
        """Level [N m] and bristle [rad] of each friction element, then of each such link."""
        n, loose = len(self.backlash), self.two_mass_joints
        level = self.coulomb.copy()
        level[:n] *= self.on_motor
        link = self.coulomb[loose] * self.link_friction_share[loose]
        return np.append(level, link), np.append(self.bristle, self.bristle[loose])

    @property
    def rows(self) -> Array:
        """Speeds of the `coulomb_elements`, then of the ties, from all coordinates' speeds."""
        (m, n), loose = self.friction_rows.shape, self.two_mass_joints
        links = m + np.arange(len(loose))
        ties = links + len(loose)
        rows = np.zeros((m + 2 * len(loose), n + len(loose)))
        rows[:m, self.motor_index] = self.friction_rows
        rows[links, loose] = 1.0
        rows[ties, loose], rows[ties, self.motor_index[loose]] = 1.0, -1.0
        return rows


def simulated_arm(chain: Chain, delta: Array, viscous: Array, coulomb: Array) -> SimulatedArm:
    """An arm with links, viscous and stick friction, ideal drives and encoders."""
    n = len(viscous)
    none = np.zeros(n)
    return SimulatedArm(
        chain=chain,
        delta=delta,
        armature=np.zeros((n, n)),
        viscous=viscous,
        friction_rows=np.eye(n),
        coulomb=coulomb,
        bristle=none,
        gain=np.eye(n),
        limit=np.full(n, np.inf),
        delay_s=none,
        encoder_zero=none,
        motor=none,
        backlash=none,
        compliance=none,
        damping=none,
        link_friction_share=none,
    )


@term
def no_term(t, q, qd, load, joint, settings, resistance, level):
    """Nothing: stands where an arm has no further torques."""


@term
def constant_torque(t, q, qd, load, joint, settings, resistance, level):
    """One setting: the torque."""
    resistance[joint] += settings[0]
