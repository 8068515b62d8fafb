"""The closed loop: reference, controller, drives, arm, encoders; one row of the log per cycle."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import NumbaExperimentalFeatureWarning

from ident.dynamics.compiled_chain import Chain, inverse_dynamics, workspace
from ident.signals.arrays import Array
from ident.simulation.arm import SETTINGS, SimulatedArm, no_term
from ident.simulation.step import Plant, State, advance, copy, scratch
from wamctl.arm.compilation import compiled
from wamctl.arm.recording import Command, Recording
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Reference

_STEPS_PER_CYCLE = 4
_TUPLE = 8  # functions of terms that are handed to the compiled loop together


@dataclass(frozen=True)
class Controller:
    """Computed torque and PD on acceleration (47), (48).

    Attributes:
        chain, delta: the controller's own model.
        stiffness: [1/s^2], shape (n,).
        damping: [1/s], shape (n,).
        velocity_cutoff_hz: first-order low-pass on the differentiated position.
    """

    chain: Chain
    delta: Array
    stiffness: Array
    damping: Array
    velocity_cutoff_hz: float


@dataclass(frozen=True)
class Wire:
    """What digital drives do to positions and torques.

    Attributes:
        motor_from_joint: shape (n, n).
        counts_per_revolution: of each motor's encoder, shape (n,).
        torque_step: smallest motor torque step [N m], shape (n,).
        period_s: cycle time [s].
    """

    motor_from_joint: Array
    counts_per_revolution: Array
    torque_step: Array
    period_s: float

    def read(self, q: Array) -> Array:
        """Joint positions [rad] as the encoders tell them, in whole counts, shape (n,)."""
        step = 2 * np.pi / self.counts_per_revolution
        counts = np.rint(self.motor_from_joint @ q / step)
        return np.linalg.solve(self.motor_from_joint, counts * step)

    def given(self, torque: Array) -> Array:
        """Joint torque [N m] that drives give when asked for one, in whole steps, shape (n,)."""
        motor = np.linalg.solve(self.motor_from_joint.T, torque)
        return self.motor_from_joint.T @ (np.rint(motor / self.torque_step) * self.torque_step)


@dataclass(frozen=True)
class Run:
    """A simulated log.

    Attributes:
        q: encoder positions [rad], shape (S, n).
        tau_cmd: commanded torque that acts from each instant on [N m], shape (S, n).
    """

    q: Array
    tau_cmd: Array


class _Law(NamedTuple):
    chain: Chain
    delta: Array
    stiffness: Array
    damping: Array
    smoothing: float
    motor: Array
    joint: Array
    angle_step: Array
    step: Array
    period: float


def run(
    arm: SimulatedArm,
    controller: Controller,
    wire: Wire,
    wanted: tuple[Array, Array, Array],
    disturbance: Array | None = None,
) -> Run:
    """Follow a reference in closed loop, from its first sample and velocity.

    Args:
        arm: what is simulated.
        controller: the law and its model.
        wire: drives and encoders.
        wanted: reference position, velocity and acceleration, each of shape (S, n).
        disturbance: torque that resists beside the arm's own [N m], shape (S, n); None: none.
    """
    noise = np.zeros_like(wanted[0]) if disturbance is None else disturbance
    functions = compiled_tuple([t.function for t in arm.terms])
    settings = np.zeros((len(arm.terms), SETTINGS))
    for i, item in enumerate(arm.terms):
        settings[i, : len(item.settings)] = item.settings
    joints = np.array([t.joint for t in arm.terms], dtype=np.int64)
    loose = arm.two_mass_joints
    plant = Plant(
        arm.chain, arm.delta, arm.armature, arm.drag, arm.rows, *arm.coulomb_elements,
        arm.gain, arm.limit, arm.delay_s, arm.encoder_zero, arm.motor_index, arm.motor[loose],
        arm.backlash[loose], arm.compliance[loose], arm.damping[loose], joints, settings,
    )  # fmt: skip
    smoothing = 1.0 - np.exp(-2 * np.pi * controller.velocity_cutoff_hz * wire.period_s)
    law = _Law(
        controller.chain, controller.delta, controller.stiffness, controller.damping, smoothing,
        wire.motor_from_joint, np.linalg.inv(wire.motor_from_joint),
        2 * np.pi / wire.counts_per_revolution, wire.torque_step, wire.period_s,
    )  # fmt: skip
    with warnings.catch_warnings():
        # tuples of compiled functions: what lets an effect bring its own torque
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        motion = [np.ascontiguousarray(w) for w in (*wanted, noise)]
        q, tau = _simulate(functions, plant, law, motion[0], motion[1], motion[2], motion[3])
    return Run(q, tau)


def compiled_tuple(functions: Sequence[Callable[..., None]]) -> tuple[Callable[..., None], ...]:
    """The functions, and idle ones behind them, in a tuple of few possible lengths.

    The loop is compiled once for each length, which takes many seconds.
    """
    idle = -len(functions) % _TUPLE if functions else _TUPLE
    return (*functions, *(no_term,) * idle)


@compiled
def _simulate(functions, arm, law, q_ref, qd_ref, qdd_ref, noise):
    samples, n = q_ref.shape
    q_log, tau_log = np.empty((samples, n)), np.empty((samples, n))
    m, (elements, size) = arm.coulomb.size, arm.rows.shape
    state = State(np.empty(size), np.zeros(size), np.zeros(n), np.zeros(m), np.zeros(elements))
    w, law_w, tmp = workspace(n), workspace(n), scratch(n, size, m, elements)
    _start(arm, state, q_ref[0], qd_ref[0], w, tmp)
    applied_torque, torque = np.zeros(n), np.zeros(n)
    velocity, last, alpha = qd_ref[0].copy(), np.zeros(n), np.empty(n)
    for k in range(samples):
        _read(arm, law, state, q_log[k])
        if k == 0:
            copy(q_log[0], last)
            inverse_dynamics(law.chain, law.delta, q_log[0], velocity, tmp.zero, law_w, torque)
            _round(law, torque)
        copy(torque, tau_log[k])
        for i in range(n):
            velocity[i] += law.smoothing * ((q_log[k, i] - last[i]) / law.period - velocity[i])
            last[i] = q_log[k, i]
            error, rate = q_ref[k, i] - q_log[k, i], qd_ref[k, i] - velocity[i]
            alpha[i] = qdd_ref[k, i] + law.stiffness[i] * error + law.damping[i] * rate
        inverse_dynamics(law.chain, law.delta, q_log[k], velocity, alpha, law_w, torque)
        _round(law, torque)
        for s in range(_STEPS_PER_CYCLE):
            t = (k + s / _STEPS_PER_CYCLE) * law.period
            _drive(arm, law, tau_log, k, t, applied_torque)
            for i in range(n):
                applied_torque[i] -= noise[k, i]
            advance(functions, arm, state, w, tmp, applied_torque, t, law.period / _STEPS_PER_CYCLE)
    return q_log, tau_log


@compiled
def _start(arm, state, wanted, speed, w, tmp):
    """At the wanted speed, where encoders read what is wanted.

    A compliant tie hangs by the arm's weight.
    """
    n = wanted.size
    for i in range(n):
        state.q[i] = wanted[i] + arm.encoder_zero[i]
        state.q[arm.motor_index[i]] = state.q[i]
        state.v[i] = speed[i]
        state.v[arm.motor_index[i]] = speed[i]
    inverse_dynamics(arm.chain, arm.delta, state.q[:n], tmp.zero, tmp.zero, w, tmp.bias)
    for i in range(n):
        if arm.motor_index[i] != i:
            state.q[i] -= arm.compliance[arm.motor_index[i] - n] * tmp.bias[i]


@compiled
def _read(arm, law, state, out):
    """Encoder positions: joint positions as the motors see them, in whole counts."""
    seen = np.empty(out.size)
    for i in range(out.size):
        seen[i] = state.q[arm.motor_index[i]] - arm.encoder_zero[i]
    _in_whole_steps(law.motor, law.angle_step, law.joint, seen, out)


@compiled
def _round(law, torque):
    """Joint torque as whole steps of motor torque give it."""
    _in_whole_steps(law.joint.T, law.step, law.motor.T, torque, torque)


@compiled
def _in_whole_steps(to_motor, step, to_joint, values, out):
    """Values of the joints, each rounded to whole steps on the motors' side."""
    n = out.size
    motor = np.empty(n)
    for i in range(n):
        value = 0.0
        for j in range(n):
            value += to_motor[i, j] * values[j]
        motor[i] = np.floor(value / step[i] + 0.5) * step[i]
    for i in range(n):
        out[i] = 0.0
        for j in range(n):
            out[i] += to_joint[i, j] * motor[j]


@compiled
def _drive(arm, law, tau_log, k, t, applied_torque):
    """Joint torque that acts at time t: commanded a delay ago, clipped, times the gains."""
    applied_torque[:] = 0.0
    for j in range(applied_torque.size):
        at = int(np.floor((t - arm.delay[j]) / law.period + 1e-9))
        command = tau_log[max(0, min(k, at)), j]
        clipped = min(max(command, -arm.limit[j]), arm.limit[j])
        for i in range(applied_torque.size):
            applied_torque[i] += arm.gain[i, j] * clipped


def recorded(
    joint_names: tuple[str, ...],
    motion: Reference,
    made: Run,
    attachments: dict[str, bytes],
    metadata: dict[str, str],
) -> Recording:
    """Positions beside the commanded torque and the wanted motion.

    Args:
        joint_names: n names.
        motion: what was wanted, S samples of n joints.
        made: what came of it.
        attachments: files inside the log.
        metadata: facts about the run.
    """
    stamps = np.round(motion.t * 1e9).astype(np.int64)
    return Recording(
        joint_names=joint_names,
        stamp_ns=stamps,
        q=made.q,
        qd=None,
        effort=None,
        command=Command(stamps, motion.q, motion.qd, made.tau_cmd),
        reference=ReferenceSeries(stamps, motion.q, motion.qd, motion.qdd),
        metadata=metadata,
        attachments=attachments,
    )
