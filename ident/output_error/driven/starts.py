"""Where fits with an effect begin, what a fit leaves of them, and how small they may be."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.driven.columns import DrivenArm, Moved, Place
from ident.output_error.driven.fit import DrivenFit
from ident.output_error.missing.kinds import KINDS, EffectKind
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.search import parts
from ident.signals.arrays import Array

LEAST_GAIN = 0.1
"""Nats per sample of all joints that an effect has to bring: another form in which dry friction
turns round passes for 0.09."""

_ROTORS = (0.03, 0.15)  # of a joint's inertia that gears may have before them
_TWISTS = (5e-4, 2e-3, 5e-3, 0.012)  # rad under the torque's rms
_PLAYS = (1e-3, 2.5e-3, 5e-3, 0.01)  # rad, half of it
_FRICTIONS = (0.3, 1.0)
_PARTS = (0.1, 0.3)
_BEHIND = 0.3
_LAG_S = 1e-3
_SMALL = 0.1  # of the torque's rms: what a signed size is measured in


@dataclass(frozen=True)
class Start:
    """An effect at a joint, as a fit may begin with it.

    Attributes:
        kind: what it is.
        joint: from 0.
        settings: with it, shape (quantities, n).
        further: what is fitted of it.
    """

    kind: EffectKind
    joint: int
    settings: Array
    further: tuple[Moved, ...]

    @property
    def size_at(self) -> Place:
        """Where its size is."""
        return ROW[self.kind.part.quantities[0]], self.joint


def gives(kind: EffectKind) -> bool:
    """Whether gears are loose with it."""
    return kind.part in (parts.HALF_PLAY, parts.COMPLIANCE)


def starts_of(arm: DrivenArm, now: DrivenFit, moving: NDArray[np.bool_]) -> Iterator[Start]:
    """Every effect at every joint that moves, at its sizes."""
    q = np.concatenate([s.q for s in arm.setup.segments])
    speed = np.concatenate([np.gradient(s.q, s.motion.t, axis=0) for s in arm.setup.segments])
    fast, far = speed.std(axis=0), np.abs(q).max(axis=0)
    inertia = arm.inertia
    for j in np.flatnonzero(moving).tolist():
        torque, dry = arm.torque[j], max(now.settings[ROW["coulomb"], j], 0.02 * arm.torque[j])
        signed = {
            "offset": _SMALL * torque,
            "spring": _SMALL * torque / max(far[j], 0.1),
            "drag": _SMALL * torque / fast[j] ** 2,
            "skew": _SMALL * torque / fast[j],
            "zero": 0.01,
        }
        for kind in KINDS:
            first = kind.part.quantities[0]
            if kind.part in (parts.HALF_PLAY, parts.COMPLIANCE):
                play = kind.part == parts.HALF_PLAY
                sizes = _PLAYS if play else tuple(x / torque for x in _TWISTS)
                for size in sizes:
                    for share in _ROTORS:
                        rotor = max(share * inertia[j], now.settings[ROW["armature"], j])
                        values = {first: size, "armature": rotor, "link_friction": _BEHIND,
                                  "gear_lag": _LAG_S}  # fmt: skip
                        yield _start(kind, j, now, values, ())
            elif first in signed:
                further = [Moved((ROW[n], int(j)), signed[n]) for n in kind.part.quantities]
                for side in (-0.3, 0.3):
                    yield _start(kind, j, now, {first: side * signed[first]}, further)
            else:
                sizes = _FRICTIONS if first == "stribeck" else _PARTS
                for size in sizes:
                    value = size * dry if first == "stribeck" else size
                    yield _start(kind, j, now, {first: value}, ())


def _start(
    kind: EffectKind, joint: int, now: DrivenFit, values: dict[str, float], signed: Sequence[Moved]
) -> Start:
    made = now.settings.copy()
    for name, value in values.items():
        made[ROW[name], joint] = value + (made[ROW[name], joint] if signed else 0.0)
    further = () if gives(kind) else kind.part.quantities
    names = list(dict.fromkeys([*values, *further]))
    further = tuple(signed) or tuple(Moved((ROW[n], int(joint))) for n in names)
    low = np.array([q.low for q in QUANTITIES])[:, None]
    return Start(kind, int(joint), np.maximum(made, low), further)


def shown(
    arm: DrivenArm, end: DrivenFit, moving: NDArray[np.bool_], floor: Array, asked: Array
) -> dict[str, Array]:
    """The smallest size of each effect that would be named, by joint; NaN: none, shape (n,).

    Args:
        arm: arm and recordings.
        end: the arm with all that was found.
        moving: joints that moved, shape (n,).
        floor: rms of the positions' noise [rad], shape (n,).
        asked: how much of some joint's error an effect has to explain [rad], shape (n,).
    """
    sizes = {kind.name: np.full(len(floor), np.nan) for kind in KINDS}
    beyond, setup = Beyond(end, floor), replace(arm.setup, delta=end.links)
    starts = [s for s in starts_of(arm, end, moving) if end.settings[s.size_at] == 0.0]
    left = setup.residuals_of([s.settings for s in starts])
    for start, residuals in zip(starts, left, strict=True):
        change = beyond(residuals - end.residuals)
        share = np.mean(change**2, axis=0)
        told = 0.5 * float(np.sum(np.log1p(share))) / LEAST_GAIN
        told = min(told, float(np.max(share * (floor / asked) ** 2)))
        size = abs(float(start.settings[start.size_at]))
        if told >= 1.0:
            size /= np.sqrt(told)
            sizes[start.kind.name][start.joint] = np.fmin(sizes[start.kind.name][start.joint], size)
    return sizes


class Beyond:
    """What a fit's parameters can't do of residuals, in units of some rms."""

    def __init__(self, fit: DrivenFit, usual: Array) -> None:
        self._usual = usual
        self._basis = np.linalg.qr((fit.columns / usual).reshape(len(fit.columns), -1).T)[0]

    def __call__(self, residuals: Array) -> Array:
        """Of residuals [rad], shape (S, n)."""
        flat = (residuals / self._usual).ravel()
        return (flat - self._basis @ (self._basis.T @ flat)).reshape(residuals.shape)
