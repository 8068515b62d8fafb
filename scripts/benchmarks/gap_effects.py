"""Hidden effects of the blind benchmark, in forms that the catalogue does not use.

A maker gets a random generator, a place, and a size [SI] and gives the hidden truth. Sizes are
drawn by `gap_cases.py`.
"""

from dataclasses import dataclass, replace

import numpy as np
from gap_friction import Spring
from gap_plants import GAUSS, HYPERBOLA, LINE, LORENTZ, SECH, Hidden
from gap_torques import (
    beat,
    cogging,
    constant,
    cross_talk,
    drag,
    harness,
    loaded,
    odd_wave,
    one_way_drag,
    push,
    rubbing,
    stiffening,
    stop,
    warming,
)
from numpy.typing import NDArray

Array = NDArray[np.float64]

DOF = 7


@dataclass(frozen=True)
class Usual:
    """What a joint meets on the motion, each of shape (7,).

    Attributes:
        lowest, highest: reference position [rad].
        peak: largest torque of the nominal arm, friction included [N m].
    """

    lowest: Array
    highest: Array
    peak: Array


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
    seen: Usual,
) -> Hidden:
    """The hidden truth of one effect.

    Args:
        family: id, or the name of an effect outside the catalogue.
        joints: where, from 0.
        size: in the family's own unit.
        rng: chooses the form.
        motor: motor angles from joint angles, shape (7, 7).
        seen: what is usual on this motion.
    """
    return _MAKERS[family](joints, size, rng, motor, seen)


def _offset(joints, size, rng, motor, seen):
    way = rng.choice([-1.0, 1.0])
    return Hidden(torques=((constant, (joints[0], way * size)),))


def _harness(joints, size, rng, motor, seen):
    j = joints[0]
    middle = rng.uniform(seen.lowest[j], seen.highest[j])
    return Hidden(torques=((harness, (j, size, middle, rng.uniform(0.0, 0.03))),))


def _stribeck(joints, size, rng, motor, seen):
    j = joints[0]
    curve = int(rng.choice([GAUSS, LORENTZ, HYPERBOLA, SECH, LINE]))
    return Hidden(
        curve=_at(j, curve, np.int64),
        curve_size=_at(j, size),
        curve_speed=np.where(np.arange(DOF) == j, rng.uniform(0.04, 0.15), 1.0),
    )


def _drag(joints, size, rng, motor, seen):
    return Hidden(torques=((drag, (joints[0], size, float(rng.integers(0, 4)))),))


def _one_way(joints, size, rng, motor, seen):
    return Hidden(torques=((one_way_drag, (joints[0], 2 * size, rng.choice([-1.0, 1.0]))),))


def _loaded(joints, size, rng, motor, seen):
    return Hidden(torques=((loaded, (joints[0], size, float(rng.integers(0, 3)), 0.3)),))


def _shared(joints, size, rng, motor, seen):
    rows = motor[(motor[:, list(joints)] != 0).all(axis=1)]
    unit = rows / np.abs(rows).max(axis=1, keepdims=True)
    return Hidden(shared=unit, shared_level=size * rng.uniform(0.7, 1.3, len(rows)))


def _warming(joints, size, rng, motor, seen):
    form = float(rng.integers(0, 3))
    way = rng.choice([1.0, -0.5])
    share = rng.choice([0.0, 0.5])
    length = rng.uniform(15.0, 50.0) if form != 1.0 else rng.uniform(50.0, 90.0)
    return Hidden(torques=((warming, (joints[0], way * size, way * share * size, length, form)),))


def _load(joints, size, rng, motor, seen):
    """A ball of steel somewhere near the tool."""
    centre = rng.uniform((-0.05, -0.05, 0.02), (0.05, 0.05, 0.2))
    radius = np.cbrt(size / 7850.0 / (4.0 / 3.0 * np.pi))
    tensor = size * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    tensor += 0.4 * size * radius**2 * np.eye(3)
    xx, xy, xz, yy, yz, zz = tensor[np.triu_indices(3)]
    return Hidden(payload=np.array([xx, xy, xz, yy, yz, zz, *(size * centre), size]))


def _rotor(joints, size, rng, motor, seen):
    j = joints[0]
    return Hidden(rotor=size * np.outer(_at(j, 1.0), _at(j, 1.0)))


def _coupled_rotor(joints, size, rng, motor, seen):
    row = np.zeros(DOF)
    row[list(joints)] = 1.0, rng.choice([-1.0, 1.0])
    return Hidden(rotor=size * np.outer(row, row))


def _tilt(joints, size, rng, motor, seen):
    way = rng.uniform(0, 2 * np.pi)
    g = 9.81 * np.array([np.sin(size) * np.cos(way), np.sin(size) * np.sin(way), -np.cos(size)])
    return Hidden(gravity=g)


def _zero(joints, size, rng, motor, seen):
    return Hidden(zero=_at(joints[0], rng.choice([-1.0, 1.0]) * size))


def _gain(joints, size, rng, motor, seen):
    return Hidden(gain=1.0 + _at(joints[0], rng.choice([-1.0, 1.0]) * size))


def _delay(joints, size, rng, motor, seen):
    if rng.random() < 0.5:
        return Hidden(delay_s=size)
    return Hidden(lag_s=size)


def _cogging(joints, size, rng, motor, seen):
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


def _saturation(joints, size, rng, motor, seen):
    clip = np.full(DOF, np.inf)
    clip[joints[0]] = seen.peak[joints[0]] - size
    return Hidden(clip=clip, soft=float(rng.choice([0.0, 0.03])))


def _elastic(joints, size, rng, motor, seen):
    return _behind_spring(joints[0], seen.peak[joints[0]] / size, 0.0)


def _play(joints, size, rng, motor, seen):
    return _behind_spring(joints[0], _STIFF[joints[0]], size)


def _behind_spring(joint: int, stiffness: float, play: float) -> Hidden:
    """The motor's inertia is a part of what the rigid arm has at that joint."""
    there = _at(joint, 1.0)
    spring = Spring(joint, stiffness, play)
    return Hidden(spring=(spring, _MOTOR[joint]), rotor=-_MOTOR[joint] * np.outer(there, there))


_MOTOR = (0.1, 0.1, 0.03, 0.03, 2e-4, 2e-4, 2e-5)
_STIFF = (2e4, 2e4, 8e3, 6e3, 4e2, 4e2, 40.0)


def _push(joints, size, rng, motor, seen):
    link = joints[-1]
    forces = np.zeros(DOF)
    forces[: link + 1] = (
        size * rng.uniform(-1, 1, link + 1) * np.array([1, 1, 0.6, 0.6, 0.1, 0.1, 0.03])[: link + 1]
    )
    forces[link] = size * (1, 1, 0.6, 0.6, 0.1, 0.1, 0.03)[link] * rng.choice([-1.0, 1.0])
    return Hidden(torques=((push, (link, *forces, rng.uniform(8.0, 50.0), rng.uniform(0.3, 2.0))),))


def _unequal(joints, size, rng, motor, seen):
    return Hidden(unequal=_at(joints[0], size))


def _stop(joints, size, rng, motor, seen):
    j, side = joints[0], rng.choice([-1.0, 1.0])
    edge = seen.highest[j] if side > 0 else seen.lowest[j]
    span = seen.highest[j] - seen.lowest[j]
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


def _rubbing(joints, size, rng, motor, seen):
    j = joints[0]
    viscous = size if rng.random() < 0.5 else 0.0
    numbers = (j, size - viscous, viscous, rng.uniform(1.5, 6.0), rng.uniform(0, 2 * np.pi))
    return Hidden(torques=((rubbing, numbers),))


def _odd_wave(joints, size, rng, motor, seen):
    j = joints[0]
    numbers = (j, size, rng.uniform(4.0, 0.45 * np.abs(motor[:, j]).max()), rng.uniform(0, 6.28))
    return Hidden(torques=((odd_wave, numbers),))


def _cross(joints, size, rng, motor, seen):
    i = joints[0]
    j = int(rng.choice([k for k in range(DOF) if abs(k - i) in (1, 2)]))
    form = int(rng.integers(0, 3))
    return Hidden(torques=((cross_talk, (i, j, *(size if k == form else 0.0 for k in range(3)))),))


def _beat(joints, size, rng, motor, seen):
    return Hidden(
        torques=((beat, (joints[0], size, rng.uniform(2.0, 25.0), rng.uniform(0, 6.28))),)
    )


def _stiffening(joints, size, rng, motor, seen):
    j = joints[0]
    return Hidden(torques=((stiffening, (j, size, 0.5 * (seen.lowest[j] + seen.highest[j]))),))


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
    "payload": _load,
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


def try_pair(first: Hidden, second: Hidden) -> Hidden:
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
