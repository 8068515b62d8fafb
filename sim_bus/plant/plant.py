"""The physics of the arm behind its transmission."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sim_bus.plant.friction_step import step
from sim_bus.plant.physics import Physics, StepState
from wamctl.arm.arrays import Array
from wamctl.arm.robot import Robot, with_parameters

_NS = 1e-9


@dataclass(frozen=True)
class EndStops:
    """Mechanical stops as springs with dampers, joint side, each of shape (n,).

    Attributes:
        lower, upper: where they begin [rad].
        stiffness: [N m/rad].
        damping: [N m s/rad].
    """

    lower: Array
    upper: Array
    stiffness: Array
    damping: Array


class Plant:
    """An arm of n joints, driven by motor torques, with a time of its own.

    Attributes:
        q: joint positions [rad], shape (n,).
        qd: joint velocities [rad/s], shape (n,).
        time_ns: how far the physics has gone [ns].
    """

    def __init__(
        self, robot: Robot, physics: Physics, stops: EndStops, q: Array, step_ns: int
    ) -> None:
        truth = physics.truth
        true_robot = with_parameters(robot, truth.delta)
        self._model, self._data = true_robot.model, true_robot.data()
        self._model.gravity.linear = physics.gravity_m_s2
        self._physics = physics
        self._transmission = truth.motor_from_joint
        armature = self._at_joints(truth.rotor_inertia) + physics.armature
        self._linear = np.array([armature, np.diag(truth.viscous) + physics.drag])
        self._stops = np.array([stops.lower, stops.upper, stops.stiffness, stops.damping])
        bound = np.concatenate([truth.coulomb, physics.slide_torque])
        self._bounds = np.array([-bound, bound])
        self._friction = np.array([-bound, bound, np.zeros_like(bound)])
        at_rest = [q, np.zeros_like(q)]
        self._motion = np.array(at_rest + at_rest)
        self.q, self.qd, *self._middle = self._motion
        self._step_ns = step_ns
        self._released_ns: int | None = 0
        self.time_ns = 0
        self._state = self._state_of(np.zeros_like(q))

    @property
    def is_held(self) -> bool:
        """Whether a stand holds the arm, so that nothing moves."""
        return self._released_ns is None

    @property
    def least_inertia(self) -> float:
        """Of any motion of the joints in this pose [kg m^2]; positive for an arm that can be."""
        mass = pin.crba(self._model, self._data, self.q)
        whole = np.triu(mass) + np.triu(mass, 1).T + self._linear[0]
        return float(np.linalg.eigvalsh(whole)[0])

    def hold(self) -> None:
        """Put the arm on a stand."""
        self._released_ns = None

    def release(self) -> None:
        """Let the arm go."""
        self._released_ns = self.time_ns

    def advance(self, time_ns: int, motor_torque: Array, braking: Array) -> None:
        """Go on by whole inner steps, as long as they end by `time_ns`.

        Args:
            time_ns: where to [ns].
            motor_torque: [N m], motor side, shape (n,).
            braking: viscous torque of motors without power [N m s/rad], motor side, shape (n,).
        """
        steps = (time_ns - self.time_ns) // self._step_ns
        if steps <= 0:
            return
        if not self.is_held:
            linear = self._linear
            if np.count_nonzero(braking):
                linear = _damped(linear, self._at_joints(braking))
            if self._physics.on_motors or self._physics.on_joints or self._physics.encoder_models:
                self._run_with_effects(steps, motor_torque, linear)
            else:
                self._run(steps, self._transmission.T @ motor_torque, linear)
        self.time_ns += steps * self._step_ns

    def warm_up(self) -> None:
        """One step that leaves no trace, so that everything is compiled."""
        motion, friction = self._motion.copy(), self._friction.copy()
        self._run(1, np.zeros_like(self.q), self._linear)
        self._motion[:], self._friction[:] = motion, friction

    def seen_at(self, time_ns: int) -> Array:
        """Joint positions [rad] as the encoders see them, within a step of the present."""
        q = self.q + self.qd * ((time_ns - self.time_ns) * _NS)
        for model in self._physics.encoder_models:
            q = model(q, self._state)
        return q

    def _run(self, steps: int, torque: Array, linear: Array) -> None:
        model, data, motion, (q, qd) = self._model, self._data, self._motion, self._middle
        stops, slides = self._stops, self._physics.slides
        friction, h = self._friction, self._step_ns * _NS
        for _ in range(steps):
            mass = pin.crba(model, data, q)
            bias = pin.nonLinearEffects(model, data, q, qd)
            step(mass, torque - bias, motion, linear, stops, slides, friction, h)

    def _run_with_effects(self, steps: int, motor_torque: Array, linear: Array) -> None:
        for k in range(steps):
            self._state = state = self._state_of(motor_torque, k)
            for act in self._physics.on_motors:
                act(state)
            state.load = self._transmission.T @ state.motor
            for act in self._physics.on_joints:
                act(state)
            self._friction[:2] = state.bounds
            self._run(1, state.load + state.torque, _damped(linear, np.diag(state.drag)))

    def _state_of(self, motor_torque: Array, steps_ahead: int = 0) -> StepState:
        q, qd = self._middle
        now_ns = self.time_ns + steps_ahead * self._step_ns - (self._released_ns or 0)
        nothing = np.zeros_like(q)
        return StepState(
            now_ns * _NS,
            self._step_ns * _NS,
            q,
            qd,
            motor_torque.copy(),
            nothing,
            nothing.copy(),
            nothing.copy(),
            self._bounds.copy(),
        )

    def _at_joints(self, motor_side: Array) -> Array:
        """Matrix that a quantity of each motor (inertia, drag) is at the joints, shape (n, n)."""
        return self._transmission.T @ np.diag(motor_side) @ self._transmission


def _damped(linear: Array, viscous: Array) -> Array:
    """The same with more viscous friction [N m s/rad], shape (n, n)."""
    return linear + np.array([np.zeros_like(viscous), viscous])
