"""The closed loop: reference, controller, drives, arm, encoders; one row of the log per cycle."""

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import NumbaExperimentalFeatureWarning, njit
from numpy.typing import NDArray

from ident.simulation.arm import SETTINGS, SimulatedArm, no_term
from ident.simulation.chain import Chain, inverse_dynamics, mass_matrix, workspace

Array = NDArray[np.floating]

_SWEEPS = 12  # of Gauss-Seidel, from the last step's solution
_SWEEPS_WITH_PLAY = 60  # a light motor between friction and a heavy link is slow to settle
_STEPS_PER_CYCLE = 4


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


@dataclass(frozen=True)
class Run:
    """A simulated log.

    Attributes:
        q: encoder positions [rad], shape (S, n).
        tau_cmd: commanded torque that acts from each instant on [N m], shape (S, n).
    """

    q: Array
    tau_cmd: Array


class _Arm(NamedTuple):
    chain: Chain
    delta: Array
    armature: Array
    drag: Array
    rows: Array
    coulomb: Array
    bristle: Array
    gain: Array
    limit: Array
    delay: Array
    zero: Array
    give: Array
    seat: NDArray[np.int64]
    slack: Array
    motor: Array
    joints: NDArray[np.int64]
    settings: Array


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


class _State(NamedTuple):
    q: Array
    v: Array
    a: Array
    stretch: Array
    push: Array


def run(
    arm: SimulatedArm,
    controller: Controller,
    wire: Wire,
    wanted: tuple[Array, Array, Array],
    disturbance: Array | None = None,
) -> Run:
    """Follow a reference in closed loop, from rest at its first sample.

    Args:
        arm: what is simulated.
        controller: the law and its model.
        wire: drives and encoders.
        wanted: reference position, velocity and acceleration, each of shape (S, n).
        disturbance: torque that resists beside the arm's own [N m], shape (S, n); None: none.
    """
    noise = np.zeros_like(wanted[0]) if disturbance is None else disturbance
    functions = tuple(t.function for t in arm.terms) or (no_term,)
    settings = np.zeros((len(functions), SETTINGS))
    for i, item in enumerate(arm.terms):
        settings[i, : len(item.settings)] = item.settings
    joints = np.array([t.joint for t in arm.terms] or [0])
    loose = arm.loose
    plant = _Arm(
        arm.chain, arm.delta, arm.armature, arm.drag, arm.rows, *arm.dry,
        arm.gain, arm.limit, arm.delay_s, arm.zero, arm.give, arm.seats, arm.slack[loose],
        arm.motor[loose], joints, settings,
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


@njit(cache=True)
def _simulate(functions, arm, law, q_ref, qd_ref, qdd_ref, noise):
    samples, n = q_ref.shape
    q_log, tau_log = np.empty((samples, n)), np.empty((samples, n))
    m, (elements, size) = arm.coulomb.size, arm.rows.shape
    state = _State(np.empty(size), np.zeros(size), np.zeros(n), np.zeros(m), np.zeros(elements))
    for i in range(n):
        state.q[i] = q_ref[0, i] + arm.zero[i]
        state.q[arm.seat[i]] = state.q[i]
    w, law_w, tmp = workspace(n), workspace(n), _scratch(n, size, m, elements)
    acting, torque = np.zeros(n), np.zeros(n)
    velocity, last, alpha = np.zeros(n), np.zeros(n), np.empty(n)
    for k in range(samples):
        _read(arm, law, state, acting, q_log[k])
        if k == 0:
            _copy(q_log[0], last)
            inverse_dynamics(law.chain, law.delta, q_log[0], velocity, velocity, law_w, torque)
            _round(law, torque)
        _copy(torque, tau_log[k])
        for i in range(n):
            velocity[i] += law.smoothing * ((q_log[k, i] - last[i]) / law.period - velocity[i])
            last[i] = q_log[k, i]
            error, rate = q_ref[k, i] - q_log[k, i], qd_ref[k, i] - velocity[i]
            alpha[i] = qdd_ref[k, i] + law.stiffness[i] * error + law.damping[i] * rate
        inverse_dynamics(law.chain, law.delta, q_log[k], velocity, alpha, law_w, torque)
        _round(law, torque)
        for s in range(_STEPS_PER_CYCLE):
            t = (k + s / _STEPS_PER_CYCLE) * law.period
            _drive(arm, law, tau_log, k, t, acting)
            for i in range(n):
                acting[i] -= noise[k, i]
            _step(functions, arm, state, w, tmp, acting, t, law.period / _STEPS_PER_CYCLE)
    return q_log, tau_log


@njit(cache=True)
def _copy(values, out):
    for i in range(values.size):
        out[i] = values[i]


@njit(cache=True)
def _read(arm, law, state, acting, out):
    """Encoder positions: joint positions as the motors see them, in whole counts."""
    n = out.size
    seen = np.empty(n)
    for i in range(n):
        seen[i] = state.q[arm.seat[i]] - arm.zero[i] + arm.give[i] * acting[i]
    counts = np.empty(n)
    for i in range(n):
        angle = 0.0
        for j in range(n):
            angle += law.motor[i, j] * seen[j]
        counts[i] = np.floor(angle / law.angle_step[i] + 0.5) * law.angle_step[i]
    for i in range(n):
        out[i] = 0.0
        for j in range(n):
            out[i] += law.joint[i, j] * counts[j]


@njit(cache=True)
def _round(law, torque):
    """Joint torque as whole steps of motor torque give it."""
    n = torque.size
    steps = np.empty(n)
    for i in range(n):
        motor = 0.0
        for j in range(n):
            motor += law.joint[j, i] * torque[j]
        steps[i] = np.floor(motor / law.step[i] + 0.5) * law.step[i]
    for i in range(n):
        torque[i] = 0.0
        for j in range(n):
            torque[i] += law.motor[j, i] * steps[j]


@njit(cache=True)
def _drive(arm, law, tau_log, k, t, acting):
    """Joint torque that acts at time t: commanded a delay ago, clipped, times the gain."""
    for i in range(acting.size):
        at = int(np.floor((t - arm.delay[i]) / law.period + 1e-9))
        command = tau_log[max(0, min(k, at)), i]
        acting[i] = arm.gain[i] * min(max(command, -arm.limit[i]), arm.limit[i])


@njit(cache=True)
def _step(functions, arm, state, w, tmp, acting, t, h):
    """One semi-implicit step: friction and viscous drag act on the velocity at its end."""
    n, (elements, size) = arm.seat.size, arm.rows.shape
    q, v = state.q[:n], state.v[:n]
    inverse_dynamics(arm.chain, arm.delta, q, v, tmp.zero, w, tmp.bias)
    mass_matrix(arm.chain, arm.delta, w, tmp.inertia)
    for i in range(n):
        tmp.load[i], tmp.resistance[i] = tmp.bias[i], 0.0
        for j in range(n):
            tmp.load[i] += tmp.inertia[i, j] * state.a[j]
    _copy(arm.coulomb, tmp.level)
    for f in range(len(functions)):
        functions[f](t, q, v, tmp.load, arm.joints[f], arm.settings[f], tmp.resistance, tmp.level)
    _momentum(arm, state, tmp, acting, h)
    _invert(tmp.system, tmp.inverse)
    _times(tmp.inverse, arm.rows, tmp.response)
    for i in range(size):
        tmp.free[i] = 0.0
        for j in range(size):
            tmp.free[i] += tmp.inverse[i, j] * tmp.momentum[j]
    _stick(arm, state, tmp, h)
    for i in range(size):
        after = tmp.free[i]
        for e in range(elements):
            after -= tmp.response[i, e] * state.push[e]
        if i < n:
            state.a[i] = (after - state.v[i]) / h
        state.v[i] = after
        state.q[i] += h * after


@njit(cache=True)
def _momentum(arm, state, tmp, acting, h):
    """Inertia with viscous drag, and the momentum that it will have without dry friction."""
    n, size = arm.seat.size, state.q.size
    for i in range(size):
        for j in range(size):
            linked = i < n and j < n
            tmp.system[i, j] = tmp.inertia[i, j] + arm.armature[i, j] if linked else 0.0
    for k in range(size - n):
        tmp.system[n + k, n + k] = arm.motor[k]
    for i in range(size):
        tmp.momentum[i] = -h * (tmp.bias[i] + tmp.resistance[i]) if i < n else 0.0
        for j in range(size):
            tmp.momentum[i] += tmp.system[i, j] * state.v[j]
    for i in range(n):
        tmp.momentum[arm.seat[i]] += h * acting[i]
    for i in range(size):
        tmp.system[i, i] += h * arm.drag[i]


@njit(cache=True)
def _times(a, rows, out):
    """A rows^T."""
    for i in range(out.shape[0]):
        for e in range(out.shape[1]):
            out[i, e] = 0.0
            for j in range(rows.shape[1]):
                out[i, e] += a[i, j] * rows[e, j]


@njit(cache=True)
def _invert(matrix, out):
    """Inverse of a positive definite matrix by Gauss-Jordan steps; the matrix is used up."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        pivot = 1.0 / matrix[i, i]
        for c in range(n):
            matrix[i, c] *= pivot
            out[i, c] *= pivot
        for r in range(n):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for c in range(n):
                    matrix[r, c] -= factor * matrix[i, c]
                    out[r, c] -= factor * out[i, c]


@njit(cache=True)
def _stick(arm, state, tmp, h):
    """Impulses [N m s] of the Coulomb elements and plays, by projected Gauss-Seidel.

    Each friction element is a bristle that breaks at its level: impulse = h level stretch, and the
    stretch, in parts of the breaking one, grows with distance over `bristle`, ever slower (Dahl);
    without a bristle it holds until the level is reached. A play pushes where the link would go
    beyond it.
    """
    m, (elements, size) = arm.coulomb.size, arm.rows.shape
    for e in range(elements):
        tmp.speed[e] = 0.0
        for j in range(size):
            tmp.speed[e] += arm.rows[e, j] * tmp.free[j]
    _times(arm.rows, tmp.response.T, tmp.mobility)
    for e in range(m):
        most = h * max(tmp.level[e], 1e-12)
        ahead = 1.0 if tmp.speed[e] >= 0.0 else -1.0
        distance = arm.bristle[e] / max(1.0 - ahead * state.stretch[e], 1e-3)
        tmp.give[e] = distance / (h * most)
        tmp.speed[e] += tmp.give[e] * most * state.stretch[e]
        state.push[e] = min(max(state.push[e], -most), most)
    for _ in range(_SWEEPS if elements == m else _SWEEPS_WITH_PLAY):
        for e in range(elements):
            rest = tmp.speed[e]
            for f in range(elements):
                if f != e:
                    rest -= tmp.mobility[e, f] * state.push[f]
            if e < m:
                most = h * max(tmp.level[e], 1e-12)
                state.push[e] = min(max(rest / (tmp.give[e] + tmp.mobility[e, e]), -most), most)
            else:
                state.push[e] = _beyond(arm, state, e - m, h * rest) / (h * tmp.mobility[e, e])
    for e in range(m):
        state.stretch[e] = state.push[e] / (h * max(tmp.level[e], 1e-12))


@njit(cache=True)
def _beyond(arm, state, loose, moved):
    """How far a link that moves so far beside its motor would leave the play [rad]."""
    n = arm.seat.size
    twist = moved - state.q[n + loose]
    for i in range(n):
        if arm.seat[i] == n + loose:
            twist += state.q[i]
    return twist - min(max(twist, -arm.slack[loose]), arm.slack[loose])


class _Scratch(NamedTuple):
    zero: Array
    bias: Array
    load: Array
    resistance: Array
    level: Array
    inertia: Array
    momentum: Array
    free: Array
    system: Array
    inverse: Array
    response: Array
    mobility: Array
    speed: Array
    give: Array


@njit(cache=True)
def _scratch(n, size, m, elements):
    return _Scratch(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(m), np.zeros((n, n)),
        np.zeros(size), np.zeros(size), np.zeros((size, size)), np.zeros((size, size)),
        np.zeros((size, elements)), np.zeros((elements, elements)), np.zeros(elements), np.zeros(m),
    )  # fmt: skip
