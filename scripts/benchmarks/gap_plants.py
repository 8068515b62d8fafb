"""Closed-loop recordings of arms with hidden effects, for the blind benchmark of `ident gap`.

Rigid-body terms come from the compiled chain that the tests check against Pinocchio; friction
(`gap_friction.py`) and hidden effects share no code with `ident`, and have other forms.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from gap_drives import asked_torque, drives_of, encoder_angles, given_torque, model_torque
from gap_friction import Friction, Spring, integrate
from numba import NumbaExperimentalFeatureWarning, njit, types
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import (
    Chain,
    inverse_dynamics,
    mass_matrix,
    place,
    workspace,
)
from wamctl.arm.config import ArmFile
from wamctl.arm.recording import Command, Recording
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import Reference

Array = NDArray[np.float64]

STICK, DAHL, LUGRE, ERF, SMOOTHSTEP, GUDERMANN, SLIP, TAILED, ALGEBRAIC, ARCTANGENT = range(10)
NONE, GAUSS, LORENTZ, HYPERBOLA, SECH, LINE = range(6)

_VECTOR = types.Array(types.float64, 1, "C")
_SIGNATURE = types.void(types.float64, _VECTOR, _VECTOR, _VECTOR, _VECTOR, _VECTOR, _VECTOR)
_SETTINGS = 16


def hidden_torque(function: Callable[..., None]) -> Callable[..., None]:
    """Compile (t, q, qd, load, settings, torque, level), adding to `torque` and `level` [N m]."""
    return njit(_SIGNATURE, cache=True)(function)


@hidden_torque
def nothing(t, q, qd, load, settings, torque, level):
    """No torque."""


@dataclass(frozen=True)
class Body:
    """The arm itself.

    Attributes:
        delta: its true inertial parameters, shape (10 n,).
        viscous: [N m s/rad], shape (n,).
        coulomb: [N m], shape (n,).
        reversal: kind of each joint, shape (n,).
        scale: width [rad/s] or presliding distance [rad] of each joint's reversal, shape (n,).
    """

    delta: Array
    viscous: Array
    coulomb: Array
    reversal: NDArray[np.int64]
    scale: Array


@dataclass(frozen=True)
class Hidden:
    """What the nominal model does not know.

    Attributes:
        torques: compiled by `hidden_torque`, with their settings.
        rotor: added to the mass matrix [kg m^2], shape (n, n).
        curve, curve_size, curve_speed: extra friction at low speed, each of shape (n,).
        unequal: relative difference of Coulomb friction by direction, shape (n,).
        shared: speed of shared motors from the joints', shape (m, n).
        shared_level: their friction [N m], shape (m,).
        gravity: [m/s^2], shape (3,), or None for the nominal one.
        zero: encoders read the position less this [rad], shape (n,).
        gain: torque that acts per commanded torque, shape (n,).
        delay_s: [s].
        lag_s: time constant of a first-order lag of the torque [s].
        clip: joint torque that the drives give at most [N m], shape (n,).
        soft: share of the clip over which it bends; 0 is sharp.
        spring: transmission that gives, with the motor's inertia [kg m^2].
        payload: added last link parameters (payload), shape (10,).
    """

    torques: tuple[tuple[Callable[..., None], tuple[float, ...]], ...] = ()
    rotor: Array = field(default_factory=lambda: np.zeros((7, 7)))
    curve: NDArray[np.int64] = field(default_factory=lambda: np.zeros(7, dtype=np.int64))
    curve_size: Array = field(default_factory=lambda: np.zeros(7))
    curve_speed: Array = field(default_factory=lambda: np.ones(7))
    unequal: Array = field(default_factory=lambda: np.zeros(7))
    shared: Array = field(default_factory=lambda: np.zeros((0, 7)))
    shared_level: Array = field(default_factory=lambda: np.zeros(0))
    gravity: Array | None = None
    zero: Array = field(default_factory=lambda: np.zeros(7))
    gain: Array = field(default_factory=lambda: np.ones(7))
    delay_s: float = 0.0
    lag_s: float = 0.0
    clip: Array = field(default_factory=lambda: np.full(7, np.inf))
    soft: float = 0.0
    spring: tuple[Spring, float] = (Spring(-1, 0.0, 0.0), 1.0)
    payload: Array = field(default_factory=lambda: np.zeros(10))


@dataclass(frozen=True)
class Noise:
    """Torque disturbance that no model explains: an Ornstein-Uhlenbeck process on each joint.

    Attributes:
        torque: its standard deviation [N m], shape (n,).
        memory_s: its correlation time [s].
    """

    torque: Array
    memory_s: float


class _Truth(NamedTuple):
    """The arm's side."""

    chain: Chain
    delta: Array
    rotor: Array
    zero: Array
    gain: Array
    clip: Array
    soft: float
    delay: float
    lag: float
    motor_inertia: float
    shared_level: Array
    steps: int


def record(
    file: ArmFile,
    nominal: Robot,
    body: Body,
    hidden: Hidden,
    disturbance: Noise,
    reference: Reference,
    seed: int,
) -> Recording:
    """Follow a reference and log as the driver does: one row a cycle, positions in whole counts."""
    drives = drives_of(file, nominal)
    chain, period = drives.chain, drives.cycle_s
    samples, n = reference.q.shape
    friction = _friction(body, hidden, n)
    bristles = np.isin(friction.kind, (DAHL, LUGRE, SLIP)).any() or hidden.spring[0].joint >= 0
    gravity = chain.gravity if hidden.gravity is None else hidden.gravity
    delta = body.delta.copy()
    delta[-10:] += hidden.payload
    truth = _Truth(
        chain._replace(gravity=np.array(gravity, dtype=float)),
        delta,
        hidden.rotor,
        hidden.zero,
        hidden.gain,
        hidden.clip,
        hidden.soft,
        hidden.delay_s,
        hidden.lag_s,
        hidden.spring[1],
        hidden.shared_level,
        10 if bristles else 5,
    )
    functions = tuple(f for f, _ in hidden.torques) or (nothing,)
    settings = np.zeros((len(functions), _SETTINGS))
    for row, (_, values) in zip(settings, hidden.torques, strict=False):
        row[: len(values)] = values
    noise = _coloured(disturbance, samples, n, period, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        goals = np.stack([reference.q, reference.qd, reference.qdd], axis=1)
        q, tau = _follow(
            functions, settings, drives, truth, friction, hidden.spring[0], noise, goals
        )
    if not np.isfinite(q).all() or np.abs(q - reference.q).max() > 1.5:
        raise ValueError("the arm did not follow its reference")
    stamp = (np.arange(samples) * round(period * 1e9)).astype(np.int64)
    command = Command(stamp, reference.q, reference.qd, tau)
    return Recording(file.robot.joints, stamp, q, None, None, command)


def _coloured(noise: Noise, samples: int, n: int, period: float, seed: int) -> Array:
    keep = np.exp(-period / noise.memory_s)
    fresh = np.random.default_rng(seed).standard_normal((samples, n))
    out = np.empty_like(fresh)
    out[0] = fresh[0]
    for k in range(1, samples):
        out[k] = keep * out[k - 1] + np.sqrt(1 - keep**2) * fresh[k]
    return out * noise.torque


def _friction(body: Body, hidden: Hidden, n: int) -> Friction:
    m = n + len(hidden.shared)
    spring = hidden.spring[0]
    rows = np.zeros((m, n + 1))
    rows[:n, :n] = np.eye(n)
    rows[n:, :n] = hidden.shared
    if spring.joint >= 0:
        rows[:, n], rows[:, spring.joint] = rows[:, spring.joint].copy(), 0.0
    else:
        rows = np.ascontiguousarray(rows[:, :n])
    more = np.zeros(m - n)
    none = np.zeros(m - n, dtype=np.int64)
    return Friction(
        rows,
        np.append(body.reversal, none),
        np.append(body.scale, more + 1.0),
        np.append(body.coulomb, hidden.shared_level),
        np.append(hidden.unequal, more),
        np.append(hidden.curve, none),
        np.append(hidden.curve_size, more),
        np.append(hidden.curve_speed, more + 1.0),
        np.append(body.viscous, more),
    )


@njit(cache=True)
def _follow(functions, settings, drives, truth, friction, spring, noise, goals):
    """Positions and torques of the log, for goals of shape (cycles, 3, n)."""
    n = drives.kp.size
    readings, asked = np.empty_like(noise), np.empty_like(noise)
    q = np.zeros(friction.rows.shape[1])
    q[:n] = goals[0, 0] + truth.zero
    q[n:] = q[spring.joint]
    state = (q, np.zeros_like(q), np.zeros((friction.level.size, 3)), friction.level >= 0.0)
    dynamic = (workspace(n), np.zeros(n), np.zeros(n), friction.level[:n].copy())
    estimate = np.zeros(n)
    for cycle, goal in enumerate(goals):
        seen = encoder_angles(drives, _driven(q, spring, n) - truth.zero)
        if cycle == 0:
            torque = given_torque(drives, model_torque(drives, seen, estimate, estimate))
            dynamic[2][:] = torque
        else:
            estimate += drives.blend * ((seen - readings[cycle - 1]) / drives.cycle_s - estimate)
        readings[cycle], asked[cycle] = seen, torque
        torque = given_torque(drives, asked_torque(drives, seen, estimate, goal))
        _cycle(
            (functions, settings), drives.cycle_s, (truth, friction, spring), state, dynamic,
            asked[: cycle + 1], noise[cycle],
        )  # fmt: skip
    return readings, asked


@njit(cache=True)
def _driven(q, spring, n):
    """Positions on the motors' side of the transmission [rad], shape (n,)."""
    out = q[:n].copy()
    if spring.joint >= 0:
        out[spring.joint] = q[n]
    return out


@njit(cache=True)
def _cycle(hidden, cycle_s, plant, state, dynamic, asked, noise):
    """One cycle: inertia and bias at its middle, friction in smaller steps."""
    functions, settings = hidden
    truth, friction, spring = plant
    w, accel, now, coulomb = dynamic
    q, v = state[0], state[1]
    n, size, k = noise.size, q.size, len(asked) - 1
    middle, before, rest = q[:n] + 0.5 * cycle_s * v[:n], v[:n].copy(), np.zeros(n)
    bias, extra, level = np.empty(n), np.zeros(n), coulomb.copy()
    inverse_dynamics(truth.chain, truth.delta, middle, before, rest, w, bias)
    inner = np.empty((n, n))
    mass_matrix(truth.chain, truth.delta, w, inner)
    load = bias + inner @ accel
    t = (k + 0.5) * cycle_s
    for f in range(len(functions)):
        functions[f](t, middle, before, load, settings[f], extra, level)
    mass, resist = np.zeros((size, size)), np.zeros(size)
    mass[:n, :n] = inner + truth.rotor
    resist[:n] = bias + extra + noise
    if size > n:
        mass[n, n] = truth.motor_inertia
    for i in range(n):
        friction.level[i] = max(level[i], 0.0)
    commands = np.zeros((truth.steps, size))
    h = cycle_s / truth.steps
    for s in range(truth.steps):
        start = k + s / truth.steps - truth.delay / cycle_s
        first = int(np.floor(start))
        share = min(max((first + 1 - start) * truth.steps, 0.0), 1.0)
        command = share * asked[max(0, min(k, first))]
        command += (1.0 - share) * asked[max(0, min(k, first + 1))]
        if truth.lag > 0.0:
            fade = 1.0 - np.exp(-h / truth.lag)
            ahead = command - now
            command -= ahead * fade * truth.lag / h
            now += ahead * fade
        for i in range(n):
            motor = n if i == spring.joint else i
            commands[s, motor] = truth.gain[i] * _clipped(command[i], truth.clip[i], truth.soft)
    integrate(mass, resist, commands, friction, spring, state, h)
    accel[:] = (v[:n] - before) / cycle_s


@njit(cache=True)
def _clipped(tau, clip, soft):
    size = abs(tau)
    knee = (1.0 - soft) * clip
    if not size > knee:
        return tau
    room = clip - knee
    most = knee + (room * np.tanh((size - knee) / room) if room > 0.0 else 0.0)
    return most if tau > 0.0 else -most


__all__ = ["Body", "Hidden", "Noise", "hidden_torque", "place", "record"]
