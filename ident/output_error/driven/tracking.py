"""Recordings with torque as motions of a position servo.

The recorded torque drives the simulated arm, and a spring and a damper keep it near the recorded
one. What these have to do is the model's error: torque that is left over, as positions, low-passed
by the arm itself. With the gains of the loop that drove the arm this is the closed loop itself,
which is where output error in closed loop needs no restarts.

To the compiled plant, that is a servo that is asked to be where spring, damper, and torque
together would leave it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ident.dynamics.compiled_chain import Chain, inverse_dynamics, mass_matrix, workspace
from ident.output_error.plant.servo import Motion
from ident.output_error.recordings import WARM_S
from ident.output_error.setup import MotionSegment
from ident.recordings.dataset import Dataset, Segment
from ident.signals.arrays import Array

_BANDWIDTH = 20.0  # rad/s
_GIVES = 0.02  # rad under the recorded torque's rms, at most: further away, the arm is another one
_FINE_S = 0.002  # torque and position that change in steps act late by half of one
_SAMPLED_S = 0.01
_POSES = 200
_HAS_MOVED = 0.02  # rad; before that nobody knows which way a joint sticks
_BEGUN_S = 0.1


@dataclass(frozen=True)
class Tracking:
    """What keeps a simulated arm near the recorded one.

    Attributes:
        stiffness: [N m/rad], shape (n,).
        damping: critical, [N m s/rad], shape (n,).
        inertia: usual one of each joint with all that it carries [kg m^2], shape (n,).
    """

    stiffness: Array
    damping: Array
    inertia: Array


def tracking(chain: Chain, delta: Array, rotors: Array, data: Sequence[Dataset]) -> Tracking:
    """Spring and damper for some recordings.

    Args:
        chain: kinematics and gravity.
        delta: the links' parameters, shape (10 n,).
        rotors: inertia beside them [kg m^2], shape (n,).
        data: the recordings.
    """
    segments = [s for d in data for s in d.segments]
    q = np.concatenate([s.q for s in segments])
    q = np.ascontiguousarray(q[:: max(len(q) // _POSES, 1)])
    n = q.shape[1]
    work, still, out, mass = workspace(n), np.zeros(n), np.zeros(n), np.zeros((n, n))
    inertia = rotors.copy()
    for pose in q:
        inverse_dynamics(chain, delta, pose, still, still, work, out)
        mass_matrix(chain, delta, work, mass)
        inertia += np.diag(mass) / len(q)
    torque = np.concatenate([s.tau for s in segments]).std(axis=0)
    stiffness = np.maximum(inertia * _BANDWIDTH**2, torque / _GIVES)
    return Tracking(stiffness, 2.0 * np.sqrt(stiffness * inertia), inertia)


def followed(data: Sequence[Dataset], keeps: Tracking) -> tuple[MotionSegment, ...]:
    """Recordings as motions that are followed, where every joint that moves has slipped once."""
    made = []
    for d in data:
        parts = [_followed(d, s, keeps) for s in d.segments]
        made += [p for p in parts if p is not None]
    return tuple(made)


def _followed(data: Dataset, segment: Segment, keeps: Tracking) -> MotionSegment | None:
    period, first, end = 1.0 / data.rate_hz, *(segment.used or (0, len(segment.q)))
    warm = max(first - round(2 * WARM_S / period), 0)
    q, tau = segment.q[warm:end], segment.tau[warm:end]
    if len(q) * period < 4 * WARM_S:
        return None
    t = period * np.arange(len(q))
    parts = max(int(np.ceil(period / _FINE_S - 1e-6)), 1)
    fine = period / parts
    grid = fine * np.arange((len(q) - 1) * parts + 1)
    path = CubicSpline(t, q)
    if parts > 1:
        position, speed, torque = path(grid), path(grid, 1), CubicSpline(t, tau)(grid)
    else:
        position, speed, torque = q, np.gradient(q, period, axis=0), tau
    command = position + (keeps.damping * speed + torque) / keeps.stiffness
    every = max(round(_SAMPLED_S / period), 1)
    begun = min(round(_BEGUN_S / period) + 1, len(q) - 1)
    motion = Motion(
        np.ascontiguousarray(t[::every]),
        grid - 0.5 * fine,
        np.ascontiguousarray(command),
        q[0].copy(),
        (q[begun] - q[0]) / t[begun],
    )
    away = np.abs(q - q[0]) > _HAS_MOVED
    slipped = np.where(away.any(axis=0), away.argmax(axis=0), 0).max()
    counted = max(first - warm, round(WARM_S / period), int(slipped))
    if len(q) - counted < 2 * WARM_S / period:
        return None
    return MotionSegment(
        motion,
        np.ascontiguousarray(q[::every]),
        data.name,
        -(-counted // every),
        start_s=segment.start_s + warm * period,
    )
