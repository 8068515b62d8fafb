"""Hidden effects of the blind benchmark, in forms that the catalogue does not use.

A maker gets a random generator, a place, and a size [SI] and gives the hidden truth. Sizes are
drawn by `gap_cases.py`.
"""

from dataclasses import replace

import numpy as np
from gap_friction import Spring
from gap_plants import GAUSS, HYPERBOLA, LINE, LORENTZ, SECH, Hidden, hidden_torque
from numpy.typing import NDArray

Array = NDArray[np.float64]

DOF = 7


@hidden_torque
def constant(t, q, qd, load, s, torque, level):
    """Torque s1 on joint s0."""
    torque[int(s[0])] += s[1]


@hidden_torque
def harness(t, q, qd, load, s, torque, level):
    """Cable bundle: s1 (x + s3 x^3), x = q - s2, on joint s0."""
    j = int(s[0])
    x = q[j] - s[2]
    torque[j] += s[1] * (x + s[3] * x * x * x)


@hidden_torque
def drag(t, q, qd, load, s, torque, level):
    """Bent drag on joint s0: s1 times a form s2 of the speed."""
    j = int(s[0])
    v, way = abs(qd[j]), np.sign(qd[j])
    form = int(s[2])
    if form == 0:
        torque[j] += s[1] * way * v * v
    elif form == 1:
        torque[j] += s[1] * way * v**3
    elif form == 2:
        torque[j] += s[1] * way * v**1.7
    elif form == 3:
        torque[j] += s[1] * way * (np.exp(v) - 1.0 - v)
    else:
        level[j] += s[1] * np.sqrt(v)


@hidden_torque
def one_way_drag(t, q, qd, load, s, torque, level):
    """Drag s1 in one direction s2 only, on joint s0."""
    j = int(s[0])
    if qd[j] * s[2] > 0.0:
        torque[j] += s[1] * qd[j]


@hidden_torque
def loaded(t, q, qd, load, s, torque, level):
    """Coulomb level s1 times joint s0's load; form s2: whole, root of squares, driving only."""
    j = int(s[0])
    size = abs(load[j])
    form = int(s[2])
    if form == 1:
        size = np.sqrt(load[j] * load[j] + s[3] * s[3]) - abs(s[3])
    elif form == 2 and load[j] * qd[j] < 0.0:
        size = 0.0
    level[j] += s[1] * size


@hidden_torque
def warming(t, q, qd, load, s, torque, level):
    """Joint s0's Coulomb s1 and viscous s2 change over time s3; s4: exponential, line, root."""
    j = int(s[0])
    form = int(s[4])
    u = t / s[3]
    if form == 0:
        fade = np.exp(-u)
    elif form == 1:
        fade = max(0.0, 1.0 - u)
    else:
        fade = 1.0 / (1.0 + u)
    level[j] += s[1] * fade
    torque[j] += s[2] * fade * qd[j]


@hidden_torque
def cogging(t, q, qd, load, s, torque, level):
    """Harmonics s4.. (size, phase) of motor angle s1 q_a + s2 q_b, joints s0 and s3, order s10."""
    a, b = int(s[0]), int(s[3])
    angle = s[10] * (s[1] * q[a] + s[2] * q[b])
    wave = 0.0
    for h in range(3):
        wave += s[4 + 2 * h] * np.sin((h + 1) * angle + s[5 + 2 * h])
    torque[a] += s[11] * wave
    if s[2] != 0.0:
        torque[b] += s[12] * wave


@hidden_torque
def push(t, q, qd, load, s, torque, level):
    """Half a sine of s1.. on joints up to s0, from time s8 for s9 seconds."""
    u = (t - s[8]) / s[9]
    if u > 0.0 and u < 1.0:
        for j in range(int(s[0]) + 1):
            torque[j] += s[1 + j] * np.sin(np.pi * u)


@hidden_torque
def stop(t, q, qd, load, s, torque, level):
    """One-sided stop on joint s0 beyond angle s1 (side s2): stiffness s3, power s4."""
    j = int(s[0])
    depth = (q[j] - s[1]) * s[2]
    if depth > 0.0:
        torque[j] += s[2] * s[3] * depth ** s[4]


@hidden_torque
def rubbing(t, q, qd, load, s, torque, level):
    """Friction of joint s0 by its position: Coulomb s1, viscous s2, wave number s3, phase s4."""
    j = int(s[0])
    wave = np.sin(s[3] * q[j] + s[4])
    level[j] += s[1] * wave
    torque[j] += s[2] * (1.0 + wave) * qd[j]


@hidden_torque
def odd_wave(t, q, qd, load, s, torque, level):
    """Torque on joint s0 that repeats with its own angle, wave number s2: s1 sin(s2 q + s3)."""
    j = int(s[0])
    torque[j] += s[1] * np.sin(s[2] * q[j] + s[3])


@hidden_torque
def cross_talk(t, q, qd, load, s, torque, level):
    """Torque on joint s0 from joint s1: position s2, velocity s3, product of velocities s4."""
    i, j = int(s[0]), int(s[1])
    torque[i] += s[2] * q[j] + s[3] * qd[j] + s[4] * qd[i] * qd[j]


@hidden_torque
def beat(t, q, qd, load, s, torque, level):
    """Torque on joint s0 that repeats in time: s1 sin(s2 t + s3)."""
    torque[int(s[0])] += s[1] * np.sin(s[2] * t + s[3])


@hidden_torque
def stiffening(t, q, qd, load, s, torque, level):
    """Hard cubic spring about s2 on joint s0, no linear part."""
    j = int(s[0])
    torque[j] += s[1] * (q[j] - s[2]) ** 3


def _at(joint: int, value: float, kind: type = float) -> Array:
    out = np.zeros(DOF, dtype=kind)
    out[joint] = value
    return out


def make(
    family: str,
    joints: tuple[int, ...],
    size: float,
    rng: np.random.Generator,
    motor: Array,
    ranges: tuple[Array, Array],
) -> Hidden:
    """The hidden truth of one effect.

    Args:
        family: id, or the name of an effect outside the catalogue.
        joints: where, from 0.
        size: in the family's own unit.
        rng: chooses the form.
        motor: motor angles from joint angles, shape (7, 7).
        ranges: lowest and highest reference position of each joint [rad].
    """
    return _MAKERS[family](joints, size, rng, motor, ranges)


def _offset(joints, size, rng, motor, ranges):
    way = rng.choice([-1.0, 1.0])
    return Hidden(torques=((constant, (joints[0], way * size)),))


def _harness(joints, size, rng, motor, ranges):
    j = joints[0]
    middle = rng.uniform(ranges[0][j], ranges[1][j])
    return Hidden(torques=((harness, (j, size, middle, rng.uniform(0.0, 0.03))),))


def _stribeck(joints, size, rng, motor, ranges):
    j = joints[0]
    curve = int(rng.choice([GAUSS, LORENTZ, HYPERBOLA, SECH, LINE]))
    return Hidden(
        curve=_at(j, curve, np.int64),
        curve_size=_at(j, size),
        curve_speed=np.where(np.arange(DOF) == j, rng.uniform(0.04, 0.15), 1.0),
    )


def _drag(joints, size, rng, motor, ranges):
    return Hidden(torques=((drag, (joints[0], size, float(rng.integers(0, 4)))),))


def _one_way(joints, size, rng, motor, ranges):
    return Hidden(torques=((one_way_drag, (joints[0], 2 * size, rng.choice([-1.0, 1.0]))),))


def _loaded(joints, size, rng, motor, ranges):
    return Hidden(torques=((loaded, (joints[0], size, float(rng.integers(0, 3)), 0.3)),))


def _shared(joints, size, rng, motor, ranges):
    rows = motor[(motor[:, list(joints)] != 0).all(axis=1)]
    unit = rows / np.abs(rows).max(axis=1, keepdims=True)
    return Hidden(shared=unit, shared_level=size * rng.uniform(0.7, 1.3, len(rows)))


def _warming(joints, size, rng, motor, ranges):
    form = float(rng.integers(0, 3))
    way = rng.choice([1.0, -0.5])
    share = rng.choice([0.0, 0.5])
    length = rng.uniform(15.0, 50.0) if form != 1.0 else rng.uniform(50.0, 90.0)
    return Hidden(torques=((warming, (joints[0], way * size, way * share * size, length, form)),))


def _rotor(joints, size, rng, motor, ranges):
    j = joints[0]
    return Hidden(rotor=size * np.outer(_at(j, 1.0), _at(j, 1.0)))


def _coupled_rotor(joints, size, rng, motor, ranges):
    row = np.zeros(DOF)
    row[list(joints)] = 1.0, rng.choice([-1.0, 1.0])
    return Hidden(rotor=size * np.outer(row, row))


def _tilt(joints, size, rng, motor, ranges):
    way = rng.uniform(0, 2 * np.pi)
    g = 9.81 * np.array([np.sin(size) * np.cos(way), np.sin(size) * np.sin(way), -np.cos(size)])
    return Hidden(gravity=g)


def _zero(joints, size, rng, motor, ranges):
    return Hidden(zero=_at(joints[0], rng.choice([-1.0, 1.0]) * size))


def _gain(joints, size, rng, motor, ranges):
    return Hidden(gain=1.0 + _at(joints[0], rng.choice([-1.0, 1.0]) * size))


def _delay(joints, size, rng, motor, ranges):
    if rng.random() < 0.5:
        return Hidden(delay_s=size)
    return Hidden(lag_s=size)


def _cogging(joints, size, rng, motor, ranges):
    row = motor[int(rng.choice(np.flatnonzero(motor[:, joints[0]])))]
    place = np.flatnonzero(row)
    unit = row / np.abs(row).max()
    a, b = int(place[0]), int(place[-1])
    there = row[b] if b != a else 0.0
    order = float(rng.integers(1, 5))
    waves = size * np.array([1.0, rng.uniform(0, 0.4), rng.uniform(0, 0.3)])
    phases = rng.uniform(0, 2 * np.pi, 3)
    pairs = [x for pair in zip(waves, phases, strict=True) for x in pair]
    return Hidden(torques=((cogging, (a, row[a], there, b, *pairs, order, unit[a], unit[b])),))


def _saturation(joints, size, rng, motor, ranges):
    clip = np.full(DOF, np.inf)
    clip[joints[0]] = size
    return Hidden(clip=clip, soft=float(rng.choice([0.0, 0.03])))


def _elastic(joints, size, rng, motor, ranges):
    return Hidden(spring=(Spring(joints[0], size, 0.0), _MOTOR[joints[0]]))


def _play(joints, size, rng, motor, ranges):
    return Hidden(spring=(Spring(joints[0], _STIFF[joints[0]], size), _MOTOR[joints[0]]))


_MOTOR = (0.01, 0.01, 0.004, 0.003, 2e-4, 2e-4, 2e-5)
_STIFF = (2e4, 2e4, 8e3, 6e3, 4e2, 4e2, 40.0)


def _push(joints, size, rng, motor, ranges):
    link = joints[-1]
    forces = np.zeros(DOF)
    forces[: link + 1] = (
        size * rng.uniform(-1, 1, link + 1) * np.array([1, 1, 0.6, 0.6, 0.1, 0.1, 0.03])[: link + 1]
    )
    forces[link] = size * (1, 1, 0.6, 0.6, 0.1, 0.1, 0.03)[link] * rng.choice([-1.0, 1.0])
    return Hidden(torques=((push, (link, *forces, rng.uniform(8.0, 50.0), rng.uniform(0.3, 2.0))),))


def _unequal(joints, size, rng, motor, ranges):
    return Hidden(unequal=_at(joints[0], size))


def _stop(joints, size, rng, motor, ranges):
    j, side = joints[0], rng.choice([-1.0, 1.0])
    edge = ranges[1][j] if side > 0 else ranges[0][j]
    span = ranges[1][j] - ranges[0][j]
    return Hidden(
        torques=(
            (
                stop,
                (
                    j,
                    edge - side * rng.uniform(0.1, 0.3) * span,
                    side,
                    size,
                    rng.choice([1.0, 1.5, 2.0]),
                ),
            ),
        )
    )


def _rubbing(joints, size, rng, motor, ranges):
    j = joints[0]
    viscous = size if rng.random() < 0.5 else 0.0
    numbers = (j, size - viscous, viscous, rng.uniform(1.5, 6.0), rng.uniform(0, 2 * np.pi))
    return Hidden(torques=((rubbing, numbers),))


def _odd_wave(joints, size, rng, motor, ranges):
    j = joints[0]
    numbers = (j, size, rng.uniform(4.0, 0.45 * np.abs(motor[:, j]).max()), rng.uniform(0, 6.28))
    return Hidden(torques=((odd_wave, numbers),))


def _cross(joints, size, rng, motor, ranges):
    i = joints[0]
    j = int(rng.choice([k for k in range(DOF) if abs(k - i) in (1, 2)]))
    form = int(rng.integers(0, 3))
    return Hidden(torques=((cross_talk, (i, j, *(size if k == form else 0.0 for k in range(3)))),))


def _beat(joints, size, rng, motor, ranges):
    return Hidden(
        torques=((beat, (joints[0], size, rng.uniform(2.0, 25.0), rng.uniform(0, 6.28))),)
    )


def _stiffening(joints, size, rng, motor, ranges):
    j = joints[0]
    return Hidden(torques=((stiffening, (j, size, 0.5 * (ranges[0][j] + ranges[1][j]))),))


_MAKERS = {
    "torque_offset": _offset,
    "unequal_friction": _unequal,
    "joint_spring": _harness,
    "stribeck": _stribeck,
    "nonlinear_viscous": _drag,
    "asymmetric_viscous": _one_way,
    "load_dependent_friction": _loaded,
    "coupled_friction": _shared,
    "thermal_drift": _warming,
    "rotor_inertia": _rotor,
    "coupled_inertia": _coupled_rotor,
    "gravity_tilt": _tilt,
    "encoder_offset": _zero,
    "torque_gain": _gain,
    "torque_delay": _delay,
    "torque_ripple": _cogging,
    "torque_saturation": _saturation,
    "joint_elasticity": _elastic,
    "backlash": _play,
    "contact": _push,
    "one_sided_stop": _stop,
    "position_dependent_friction": _rubbing,
    "other_period": _odd_wave,
    "cross_talk": _cross,
    "periodic_in_time": _beat,
    "hard_cubic_spring": _stiffening,
}


def together(first: Hidden, second: Hidden) -> Hidden:
    """Two effects at once."""
    fresh = Hidden()
    changed = {
        name: getattr(second, name)
        for name in vars(fresh)
        if name not in ("torques", "shared", "shared_level")
        and not np.array_equal(
            np.asarray(getattr(second, name), dtype=object),
            np.asarray(getattr(fresh, name), dtype=object),
        )
    }
    return replace(
        first,
        torques=(*first.torques, *second.torques),
        shared=np.vstack([first.shared, second.shared]),
        shared_level=np.append(first.shared_level, second.shared_level),
        **changed,
    )
