"""One step of the simulated arm: rigid bodies, dry friction, and motors that move beside them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain, inverse_dynamics, invert, mass_matrix
from ident.signals.arrays import Array
from wamctl.arm.compilation import compiled

_SWEEPS = 12  # of Gauss-Seidel, from the last step's solution
_SWEEPS_WITH_TIES = 60  # a light motor between friction and a heavy link is slow to settle
_MOST = 0.9  # of the inertia that a joint feels while the others are free: its link has some too


class Plant(NamedTuple):
    """A `SimulatedArm` for compiled code: what has ties is by loose joint, not by joint."""

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
    encoder_zero: Array
    motor_index: NDArray[np.int64]
    motor: Array
    backlash: Array
    compliance: Array
    damping: Array
    joints: NDArray[np.int64]
    settings: Array


class State(NamedTuple):
    """Joints, then motors that move beside them.

    Positions [rad], velocities [rad/s], the joints' accelerations [rad/s^2], stretch of the
    friction elements in parts of the breaking one, impulses of these and of the ties [N m s].
    """

    q: Array
    v: Array
    a: Array
    stretch: Array
    impulse: Array


class Scratch(NamedTuple):
    """Space for a step."""

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
    compliance: Array


@compiled
def scratch(n, size, m, elements):
    """Space for n joints, `size` coordinates, m friction elements, `elements` with ties."""
    return Scratch(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(m), np.zeros((n, n)),
        np.zeros(size), np.zeros(size), np.zeros((size, size)), np.zeros((size, size)),
        np.zeros((size, elements)), np.zeros((elements, elements)), np.zeros(elements), np.zeros(m),
    )  # fmt: skip


@compiled
def advance(functions, arm, state, w, tmp, applied_torque, t, h):
    """One semi-implicit step: friction and viscous drag act on the velocity at its end."""
    n, (elements, size) = arm.motor_index.size, arm.rows.shape
    q, v = state.q[:n], state.v[:n]
    inverse_dynamics(arm.chain, arm.delta, q, v, tmp.zero, w, tmp.bias)
    mass_matrix(arm.chain, arm.delta, w, tmp.inertia)
    for i in range(n):
        tmp.load[i], tmp.resistance[i] = tmp.bias[i], 0.0
        for j in range(n):
            tmp.load[i] += tmp.inertia[i, j] * state.a[j]
    copy(arm.coulomb, tmp.level)
    for f in range(arm.joints.size):  # behind them, the tuple has idle ones
        functions[f](t, q, v, tmp.load, arm.joints[f], arm.settings[f], tmp.resistance, tmp.level)
    _momentum(arm, state, tmp, applied_torque, h)
    invert(tmp.system, tmp.inverse)
    _times(tmp.inverse, arm.rows, tmp.response)
    for i in range(size):
        tmp.free[i] = 0.0
        for j in range(size):
            tmp.free[i] += tmp.inverse[i, j] * tmp.momentum[j]
    _friction_impulses(arm, state, tmp, h)
    for i in range(size):
        after = tmp.free[i]
        for e in range(elements):
            after -= tmp.response[i, e] * state.impulse[e]
        if i < n:
            state.a[i] = (after - state.v[i]) / h
        state.v[i] = after
        state.q[i] += h * after


@compiled
def _momentum(arm, state, tmp, applied_torque, h):
    """Inertia with viscous drag, and the momentum that it will have without dry friction."""
    n, size = arm.motor_index.size, state.q.size
    _inertia(arm, tmp)
    if size > n:
        invert(tmp.system, tmp.inverse)
        _inertia(arm, tmp)
        for i in range(n):
            k = arm.motor_index[i]
            if k != i:
                motor = min(arm.motor[k - n], _MOST / tmp.inverse[i, i])
                tmp.system[i, i] -= motor
                tmp.system[k, k] = motor
    for i in range(size):
        tmp.momentum[i] = -h * (tmp.bias[i] + tmp.resistance[i]) if i < n else 0.0
        for j in range(size):
            tmp.momentum[i] += tmp.system[i, j] * state.v[j]
    for i in range(n):
        tmp.momentum[arm.motor_index[i]] += h * applied_torque[i]
    for i in range(size):
        tmp.system[i, i] += h * arm.drag[i]


@compiled
def _inertia(arm, tmp):
    """Mass matrix with rotors, as if no motor moved beside its joint."""
    n, size = arm.motor_index.size, tmp.system.shape[0]
    for i in range(size):
        for j in range(size):
            linked = i < n and j < n
            alone = 1.0 if i == j else 0.0
            tmp.system[i, j] = tmp.inertia[i, j] + arm.armature[i, j] if linked else alone


@compiled
def _times(a, rows, out):
    """A rows^T."""
    for i in range(out.shape[0]):
        for e in range(out.shape[1]):
            out[i, e] = 0.0
            for j in range(rows.shape[1]):
                out[i, e] += a[i, j] * rows[e, j]


@compiled
def _friction_impulses(arm, state, tmp, h):
    """Impulses [N m s] of the Coulomb elements and ties, by projected Gauss-Seidel.

    Each friction element is a bristle that breaks at its level: impulse = h level stretch, and the
    stretch, in parts of the breaking one, grows with distance over `bristle`, ever slower (Dahl);
    without a bristle it holds until the level is reached. A tie pushes where the link would go
    beyond its play: so far that it does not, or as its spring and damper do at the step's end.
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
        tmp.compliance[e] = distance / (h * most)
        tmp.speed[e] += tmp.compliance[e] * most * state.stretch[e]
        state.impulse[e] = min(max(state.impulse[e], -most), most)
    for _ in range(_SWEEPS if elements == m else _SWEEPS_WITH_TIES):
        for e in range(elements):
            rest = tmp.speed[e]
            for f in range(elements):
                if f != e:
                    rest -= tmp.mobility[e, f] * state.impulse[f]
            if e < m:
                most = h * max(tmp.level[e], 1e-12)
                state.impulse[e] = min(
                    max(rest / (tmp.compliance[e] + tmp.mobility[e, e]), -most), most
                )
            else:
                state.impulse[e] = _constraint_impulse(
                    arm, state, e - m, rest, tmp.mobility[e, e], h
                )
    for e in range(m):
        state.stretch[e] = state.impulse[e] / (h * max(tmp.level[e], 1e-12))


@compiled
def _constraint_impulse(arm, state, loose, speed, mobility, h):
    """Impulse that ties a link, which else moves so fast beside its motor [rad/s], to it."""
    n = arm.motor_index.size
    twist = h * speed - state.q[n + loose]
    for i in range(n):
        if arm.motor_index[i] == n + loose:
            twist += state.q[i]
    beyond = twist - min(max(twist, -arm.backlash[loose]), arm.backlash[loose])
    if beyond == 0.0:
        return 0.0
    damping = arm.damping[loose]
    return (beyond + damping * speed) / (arm.compliance[loose] / h + mobility * (h + damping))


@compiled
def copy(values, out):
    """Copy values into an array."""
    for i in range(values.size):
        out[i] = values[i]
