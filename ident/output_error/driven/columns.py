"""What the parameters of an arm that torque drives do to its simulated positions.

What the torque is linear in, links foremost, is pushed with: a simulation with that torque added
tells its column, and changed links need not be possible ones. Friction and gears are changed
themselves, to both sides.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import get_num_threads
from scipy.signal import savgol_filter

from ident.dynamics.base_parameters import BaseMap
from ident.dynamics.parameters import Terms
from ident.dynamics.regressor import Motion, all_columns
from ident.output_error.parameters import ROW
from ident.output_error.setup import MotionSegment, Setup
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot

Place = tuple[int, int]
"""Row of a settings array, and joint."""


class Moved(NamedTuple):
    """A setting that is fitted beside the base parameters.

    Attributes:
        place: row and joint.
        unit: in which it is fitted; 0: the setting is positive, and fitted as its logarithm.
    """

    place: Place
    unit: float = 0.0

    def at(self, start: float, x: float) -> float:
        """The setting, so far from where it began."""
        return start + self.unit * x if self.unit else start * float(np.exp(x))


FRICTION = {"fv": "damping", "fc": "coulomb"}
"""Friction of joints, and the settings that hold it."""

LEAST = 1e-6
"""Friction and rotors are no smaller in a simulation."""

_SMOOTHED_S = 0.1
_PUSH = 0.01  # of the recorded torque
_NUDGE = 0.05  # of a logarithm
_SMALL = 0.1  # of the recorded torque: friction that is less changes as if it were as large


@dataclass(frozen=True)
class DrivenArm:
    """An arm and its recordings.

    Attributes:
        robot, terms, base: what the model holds.
        setup: the recordings.
        prior: standard parameters that stand for what the base parameters leave open, shape (p,).
        stiffness: of what keeps the simulation near the recordings [N m/rad], shape (n,).
        torque: rms of the recorded one [N m], shape (n,).
        inertia: usual one of each joint with all that it carries [kg m^2], shape (n,).
    """

    robot: Robot
    terms: Terms
    base: BaseMap
    setup: Setup
    prior: Array
    stiffness: Array
    torque: Array
    inertia: Array

    def settings_with(self, beta: Array, settings: Array, further: Sequence[Moved] = ()) -> Array:
        """Settings with the friction, offsets, and rotors of base parameters.

        A rotor behind gears that give is fitted by itself, and stays.
        """
        made, rotors = settings.copy(), np.zeros(settings.shape[1])
        kinds = {p.kind for p in self.base.kept_parameters}
        for value, p in zip(beta, self.base.kept_parameters, strict=True):
            if p.kind in FRICTION:
                made[ROW[FRICTION[p.kind]], p.index - 1] = max(value, LEAST)
            elif p.kind == "fo":
                made[ROW["offset"], p.index - 1] = value
            elif p.kind == "ia":
                rotors += value * self.terms.drive_matrix[p.index - 1] ** 2
        if "ia" in kinds:
            own = own_rotors(further)
            made[ROW["armature"]] = np.maximum(rotors, LEAST)
            made[ROW["armature"], own] = settings[ROW["armature"], own]
        return made

    def links_of(self, beta: Array) -> Array:
        """Standard parameters of the links with base parameters, shape (10 n,)."""
        delta, kept = self.prior.copy(), list(self.base.kept)
        delta[kept] = 0.0
        delta[kept] = beta - self.base.K @ delta
        return delta[[p.kind == "inertial" for p in self.base.parameters]]

    @cached_property
    def pushes(self) -> tuple[Array, ...]:
        """Torque per unit of each base parameter along each segment, shape (b, S, n) [N m]."""
        return tuple(self._pushes(s) for s in self.setup.segments)

    @cached_property
    def unit(self) -> Array:
        """How much of each base parameter takes the recorded torque's size, shape (b,)."""
        shares = [np.mean((p / self.torque) ** 2, axis=(1, 2)) for p in self.pushes]
        size = np.sqrt(np.mean(shares, axis=0))
        return np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)

    def _pushes(self, segment: MotionSegment) -> Array:
        t = segment.motion.t
        period = float(np.median(np.diff(t)))
        width = max(5, 2 * int(_SMOOTHED_S / period / 2) + 1)
        smooth = [
            savgol_filter(segment.q, width, 3, deriv=d, delta=period, axis=0) for d in (0, 1, 2)
        ]
        motion = Motion(*(np.ascontiguousarray(x) for x in smooth))
        made = all_columns(self.robot, self.terms, motion, self.base.kept_parameters)
        return np.ascontiguousarray(np.moveaxis(made, -1, 0))


def own_rotors(further: Sequence[Moved]) -> list[int]:
    """Joints whose rotors are fitted beside the base parameters."""
    return [m.place[1] for m in further if m.place[0] == ROW["armature"]]


def columns(arm: DrivenArm, links: Array, settings: Array, further: Sequence[Moved]) -> Array:
    """Change of the simulated positions per parameter, shape (b + len(further), S, n).

    Args:
        arm: arm and recordings.
        links: standard parameters of the links, shape (10 n,).
        settings: friction and gears, shape (quantities, n).
        further: settings beside the base parameters, as they are fitted.
    """
    setup = replace(arm.setup, delta=links)
    ends: list[tuple[Setup, Array]] = []
    sizes: list[float] = []
    for k, p in enumerate(arm.base.kept_parameters):
        if p.kind in FRICTION:
            at = ROW[FRICTION[p.kind]], p.index - 1
            change = _NUDGE * max(settings[at], _SMALL * arm.unit[k])
            low, high = (
                _with(settings, at, max(settings[at] + x, LEAST)) for x in (-change, change)
            )
            ends += [(setup, low), (setup, high)]
            sizes.append(high[at] - low[at])
        else:
            change = _PUSH * arm.unit[k]
            still = own_rotors(further) if p.kind == "ia" else []
            ends += [(_pushed(arm, setup, k, x, still), settings) for x in (-change, change)]
            sizes.append(2.0 * change)
    for m in further:
        here = settings[m.place]
        ends += [(setup, _with(settings, m.place, m.at(here, x))) for x in (-_NUDGE, _NUDGE)]
        sizes.append(2.0 * _NUDGE)
    with ThreadPoolExecutor(get_num_threads()) as pool:
        left = list(pool.map(lambda end: end[0].residuals(end[1]), ends))
    pairs = zip(left[::2], left[1::2], sizes, strict=True)
    return np.array([(a - b) / size if size > 0.0 else 0.0 * a for a, b, size in pairs])


def _with(settings: Array, at: Place, value: float) -> Array:
    made = settings.copy()
    made[at] = value
    return made


def _pushed(arm: DrivenArm, setup: Setup, k: int, change: float, still: Sequence[int]) -> Setup:
    """Recordings whose torque lacks what a change of a base parameter takes, but at some joints."""
    made = []
    for s, torque in zip(setup.segments, arm.pushes, strict=True):
        m = s.motion
        after = 0.5 * float(m.stamp[1] - m.stamp[0])  # from a command's stamp to its middle
        rows = [np.interp(m.stamp + after, m.t, torque[k, :, j]) for j in range(torque.shape[2])]
        push = np.array(rows).T
        push[:, still] = 0.0
        command = m.command - change * push / arm.stiffness
        made.append(replace(s, motion=m._replace(command=np.ascontiguousarray(command))))
    return replace(setup, segments=tuple(made))
