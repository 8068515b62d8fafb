"""What an effect may look at: facts of the arm, and a segment beside the current model."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain
from ident.dynamics.derivatives import InverseDynamicsDerivatives, torque_slopes
from ident.signals.arrays import Array

Direction = Callable[[int, Array], Array]


@dataclass(frozen=True)
class ArmFacts:
    """What an effect may know of the arm before it looks at a recording.

    Attributes:
        chain: kinematics and gravity.
        delta: inertial parameters of the present model, shape (10 n,).
        motor_from_joint: motor angles from joint angles, shape (n, n), or None where unknown.
        moving: which joints move in the recordings, shape (n,).
        pose: about which they move [rad], shape (n,).
        peak_torque: largest commanded torque of each joint [N m], shape (n,).
        duration_s: length of the longest recording [s].
        trusted: whether delta was known before, so that it can be asked what has changed since.
        commanded: whether the torque is that of the command, which carries no noise.
        rotors: inertia at each joint of the rotor that is its own, known before [kg m^2], shape
            (n,); None: not known.
        offsets: torque of each joint that was known before [N m], shape (n,); None: not known.
    """

    chain: Chain
    delta: Array
    motor_from_joint: Array | None
    moving: NDArray[np.bool_]
    pose: Array
    peak_torque: Array
    duration_s: float
    trusted: bool = False
    commanded: bool = True
    rotors: Array | None = None
    offsets: Array | None = None

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.moving)

    def of_drives(self, qdd: Array) -> Array:
        """Torque of rotors and offsets that were known before [N m], shape (S, n)."""
        torque = np.zeros_like(qdd)
        if self.rotors is not None:
            torque += self.rotors * qdd
        return torque if self.offsets is None else torque + self.offsets

    @property
    def moving_joints(self) -> tuple[int, ...]:
        """The joints that move, from 0."""
        return tuple(int(j) for j in np.flatnonzero(self.moving))

    @property
    def coupled_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of moving joints that share a motor, from 0; neighbours if motors are unknown."""
        if self.motor_from_joint is None or not self._differentials():
            joints = self.moving_joints
            return tuple((a, b) for a, b in itertools.pairwise(joints) if b == a + 1)
        return self._differentials()

    def _differentials(self) -> tuple[tuple[int, int], ...]:
        if self.motor_from_joint is None:
            return ()
        rows = [tuple(int(j) for j in np.flatnonzero(r)) for r in self.motor_from_joint]
        pairs = {(r[0], r[1]) for r in rows if len(r) == 2}
        return tuple(sorted(p for p in pairs if self.moving[list(p)].all()))

    def knows_motors(self, pair: tuple[int, int]) -> bool:
        """Whether it is known how a pair's shared motors turn with its joints."""
        return pair in self._differentials()

    def shared_motors(self, pair: tuple[int, int]) -> Array:
        """Rows, shape (m, 2), of the motors that turn with both joints, largest entry 1."""
        if self.motor_from_joint is not None and self.knows_motors(pair):
            rows = self.motor_from_joint[:, list(pair)]
            rows = rows[(rows != 0.0).all(axis=1)]
            return rows / np.abs(rows).max(axis=1, keepdims=True)
        return np.array([[1.0, 1.0], [1.0, -1.0]])


@dataclass(frozen=True)
class Observed:
    """An unbroken stretch of a recording, with what the present model says about it.

    Attributes:
        arm: facts of the arm.
        rate_hz: of the samples.
        t: time since the recording's start [s], shape (S,).
        q, qd, qdd: smoothed motion [rad, rad/s, rad/s^2], each of shape (S, n).
        tau: commanded joint torque [N m], shape (S, n); where it was measured, the present model's:
            the measured one's noise would explain itself.
        speed: velocity from which directions are taken [rad/s], shape (S, n).
        direction: smoothed sign of each joint's velocity, shape (S, n).
        load: rigid-body torque of the present model [N m], shape (S, n).
        carried: torque of effects in the model that act on the links beside it [N m], shape (S, n).
        gravity: the part of it that the arm at rest would need [N m], shape (S, n).
        viscous, coulomb: joint friction of the present model [N m s/rad, N m], each of shape (n,).
        along: smoothed sign of any speed, with the width of a given joint.
        memo: what an effect has formed for one hypothesis and needs for the next.
    """

    arm: ArmFacts
    rate_hz: float
    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    speed: Array
    direction: Array
    load: Array
    carried: Array
    gravity: Array
    viscous: Array
    coulomb: Array
    along: Direction
    memo: dict[str, Array] = field(default_factory=dict, repr=False, compare=False)
    _slopes: dict[int, InverseDynamicsDerivatives] = field(
        default_factory=dict, repr=False, compare=False
    )

    def slopes(self, joint: int) -> InverseDynamicsDerivatives:
        """How the rigid-body torque changes with one joint's motion; formed once."""
        if joint not in self._slopes:
            self._slopes[joint] = torque_slopes(
                self.arm.chain, self.arm.delta, (self.q, self.qd, self.qdd), self.load, joint
            )
        return self._slopes[joint]
