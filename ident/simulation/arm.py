"""An arm to be simulated: the identified model, actuators, sensors, and effects added to it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.signals.arrays import Array

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
    return njit(TERM, cache=True)(function)


@dataclass(frozen=True)
class Term:
    """One torque of an effect on one joint.

    Attributes:
        function: compiled by `term`.
        joint: the joint, from 0.
        settings: numbers for the function.
        text: the same for exports, by joint (from 0): expressions of C and Python alike in `q`,
            `qd`, `load` and `held` (rigid-body torque, and that at rest), with `sgn`, `step`,
            `fabs`, `pow`, `exp`, `sin` and `cos`; empty: it hangs on more than these.
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
        gain: torque that acts per commanded torque, shape (n,).
        limit: the drives clip the commanded joint torque here [N m], shape (n,).
        delay_s: the command acts later by this much [s], shape (n,).
        zero: encoders read the joint's position less this [rad], shape (n,).
        motor: inertia of a motor that moves beside its joint and carries the encoder, on the
            joint's side, a part of the joint's [kg m^2], shape (n,); 0: it moves as the joint.
        slack: half the play between such a motor and its joint [rad], shape (n,).
        give: compliance of what ties them beyond the play [rad/(N m)], shape (n,).
        damped: damping of that per its stiffness [s], shape (n,).
        rubbing: part of the friction of such a joint that its link rubs, not its motor,
            shape (n,).
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
    zero: Array
    motor: Array
    slack: Array
    give: Array
    damped: Array
    rubbing: Array
    terms: tuple[Term, ...] = field(default=())

    @property
    def loose(self) -> NDArray[np.int64]:
        """The joints with a motor that moves beside them, from 0."""
        return np.flatnonzero(self.motor > 0.0)

    def with_terms(self, *terms: Term) -> "SimulatedArm":
        """The arm with further torques."""
        return replace(self, terms=(*self.terms, *terms))

    @property
    def seats(self) -> NDArray[np.int64]:
        """The coordinate of each joint's motor: a loose one's comes after the joints'."""
        seats, loose = np.arange(len(self.slack)), self.loose
        seats[loose] = len(seats) + np.arange(len(loose))
        return seats

    @property
    def on_motor(self) -> Array:
        """Part of each joint's friction that its motor rubs, shape (n,)."""
        return np.where(self.motor > 0.0, 1.0 - self.rubbing, 1.0)

    @property
    def drag(self) -> Array:
        """Viscous friction of each coordinate [N m s/rad]."""
        drag = np.zeros(len(self.slack) + len(self.loose))
        drag[: len(self.slack)] = self.viscous * (1.0 - self.on_motor)
        drag[self.seats] += self.viscous * self.on_motor
        return drag

    @property
    def dry(self) -> tuple[Array, Array]:
        """Level [N m] and bristle [rad] of each friction element, then of each loose link."""
        n, loose = len(self.slack), self.loose
        level = self.coulomb.copy()
        level[:n] *= self.on_motor
        link = self.coulomb[loose] * self.rubbing[loose]
        return np.append(level, link), np.append(self.bristle, self.bristle[loose])

    @property
    def rows(self) -> Array:
        """Speed of each element of `dry`, then of each tie, from all coordinates' speeds."""
        (m, n), loose = self.friction_rows.shape, self.loose
        links = m + np.arange(len(loose))
        ties = links + len(loose)
        rows = np.zeros((m + 2 * len(loose), n + len(loose)))
        rows[:m, self.seats] = self.friction_rows
        rows[links, loose] = 1.0
        rows[ties, loose], rows[ties, self.seats[loose]] = 1.0, -1.0
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
        gain=np.ones(n),
        limit=np.full(n, np.inf),
        delay_s=none,
        zero=none,
        motor=none,
        slack=none,
        give=none,
        damped=none,
        rubbing=none,
    )


@term
def no_term(t, q, qd, load, joint, settings, resistance, level):
    """Nothing: stands where an arm has no further torques."""


@term
def constant_torque(t, q, qd, load, joint, settings, resistance, level):
    """One setting: the torque."""
    resistance[joint] += settings[0]
