"""Which effects the positions of an arm that torque drives ask for, one after the other.

Every effect is put in at every joint, at a few sizes, and all that the base parameters can do of
it is taken off, in first order; what promises most is fitted with all else. It stays where it
predicts best what is left out, beside whatever else explains as much.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.driven.columns import DrivenArm, Moved, Place
from ident.output_error.driven.fit import DrivenFit, fitted, floor_of, left_out
from ident.output_error.judging import BLOCK_S, sureness_of_all
from ident.output_error.missing.kinds import KINDS, EffectKind
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.search import parts
from ident.output_error.search.settings import SearchSettings
from ident.regression.progress import Tell
from ident.signals.arrays import Array

_TURNING = {"presliding": 1e-4, "turning_speed": 2e-3}
"""Friction turns round gradually, nobody knows how; a fit begins with next to nothing [rad, s]."""

_ROTORS = (0.03, 0.15)  # of a joint's inertia that gears may have before them
_TWISTS = (5e-4, 2e-3, 5e-3, 0.012)  # rad under the torque's rms
_PLAYS = (1e-3, 2.5e-3, 5e-3, 0.01)  # rad, half of it
_FRICTIONS = (0.3, 1.0)
_PARTS = (0.1, 0.3)
_BEHIND = 0.3
_LAG_S = 1e-3
_TRIED = 3
_TRIAL_ROUNDS = 2
LEAST_GAIN = 0.1
"""Nats per sample of all joints that an effect has to bring: another form in which dry friction
turns round passes for 0.09."""

_HOPE = 0.3  # of the best promise
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


@dataclass(frozen=True)
class Tried:
    """An effect at a joint, fitted with all else.

    Attributes:
        start: where the fit began.
        fit: of all.
        errors: of blocks of time that are left out [rad^2], shape (B, n).
        gain: nats per sample by which these are smaller, of all joints.
        sure: in standard errors over blocks.
    """

    start: Start
    fit: DrivenFit
    errors: Array
    gain: float
    sure: float


@dataclass(frozen=True)
class Step:
    """An effect that was accepted, with what else explains as much."""

    tried: Tried
    rivals: tuple[Tried, ...]


@dataclass(frozen=True)
class DrivenSearch:
    """A search's end.

    Attributes:
        base: the arm without effects.
        errors: its errors of blocks that are left out [rad^2], shape (B, n).
        steps: effects in order of acceptance.
    """

    base: DrivenFit
    errors: Array
    steps: tuple[Step, ...]

    @property
    def end(self) -> DrivenFit:
        """The arm with all that was accepted."""
        return self.steps[-1].tried.fit if self.steps else self.base

    @property
    def left(self) -> Array:
        """Errors of blocks that are left out with it [rad^2], shape (B, n)."""
        return self.steps[-1].tried.errors if self.steps else self.errors


def turning(settings: Array, moving: NDArray[np.bool_]) -> tuple[Array, list[Moved]]:
    """Settings with friction that turns round gradually, and what of them is fitted."""
    made, further = settings.copy(), []
    for name, value in _TURNING.items():
        made[ROW[name], moving] = value
        further += [Moved((ROW[name], int(j))) for j in np.flatnonzero(moving)]
    return made, further


def searched(
    arm: DrivenArm, rigid: DrivenFit, moving: NDArray[np.bool_], limits: SearchSettings, tell: Tell
) -> DrivenSearch:
    """The arm, and the effects that its recordings ask for.

    Args:
        arm: arm and recordings.
        rigid: their fit with friction that turns round at once.
        moving: joints that moved, shape (n,).
        limits: numbers that decide.
        tell: hears what is being done.
    """
    tell("simulating the arm without effects")
    began, further = turning(rigid.settings, moving)
    base = fitted(arm, rigid.beta, began, further)
    group = block_groups(arm)
    found = DrivenSearch(base, block_errors(arm, base, group), ())
    for _ in range(limits.rounds):
        now = found.end
        hopes = _promising(arm, now, moving, found, limits, tell)
        done = []
        for k, start in enumerate(hopes):
            tell("fitting what is missing", k / len(hopes))
            further = (*now.further, *start.further)
            fit = fitted(arm, now.beta, start.settings, further, rounds=_TRIAL_ROUNDS)
            done.append(_judged(arm, start, fit, found.left, group))
        sure = [t for t in done if t.gain > LEAST_GAIN and t.sure > limits.sure]
        if not sure:
            break
        first = max(sure, key=lambda t: t.gain)
        fit = fitted(arm, first.fit.beta, first.fit.settings, first.fit.further)
        best = _judged(arm, first.start, fit, found.left, group)
        rivals = [
            t for t in done
            if t is not first and t.gain > limits.rival_share * best.gain
            and sureness_of_all(t.errors, best.errors) < limits.apart
        ]  # fmt: skip
        found = replace(found, steps=(*found.steps, Step(best, tuple(rivals))))
    return found


def _judged(
    arm: DrivenArm, start: Start, fit: DrivenFit, before: Array, group: NDArray[np.int64]
) -> Tried:
    errors = block_errors(arm, fit, group)
    return Tried(start, fit, errors, gain_of_all(before, errors), sureness_of_all(before, errors))


def gain_of_all(before: Array, after: Array) -> float:
    """Nats per sample by which errors of blocks are smaller, of all joints together."""
    means = [np.log(np.maximum(x, 1e-30)).mean(axis=0) for x in (before, after)]
    return float(0.5 * (means[0] - means[1]).sum())


def block_groups(arm: DrivenArm) -> NDArray[np.int64]:
    """Block of time of each counted sample, shape (S,)."""
    made, before = [], 0
    for s in arm.setup.segments:
        t = s.motion.t[s.counted :]
        count = max(int((t[-1] - t[0]) / BLOCK_S), 1)
        made.append(
            before + np.minimum((count * (t - t[0]) / (t[-1] - t[0])).astype(int), count - 1)
        )
        before += count
    return np.concatenate(made)


def block_errors(arm: DrivenArm, fit: DrivenFit, group: NDArray[np.int64]) -> Array:
    """Mean squared error of each block, predicted from all others [rad^2], shape (B, n)."""
    left, _ = left_out(arm, fit, group)
    edges = np.flatnonzero(np.diff(group, prepend=-1)).tolist()
    means = np.add.reduceat(left**2, edges, axis=0) / np.diff([*edges, len(left)])[:, None]
    return np.maximum(means, floor_of(arm.setup) ** 2)


def _promising(
    arm: DrivenArm, now: DrivenFit, moving: NDArray[np.bool_], found: DrivenSearch,
    limits: SearchSettings, tell: Tell,
) -> list[Start]:  # fmt: skip
    """The starts that promise most in first order, one of each effect and joint."""
    there = {(s.tried.start.kind.name, s.tried.start.joint) for s in found.steps}
    loose = {s.tried.start.joint for s in found.steps if _gives(s.tried.start.kind)}
    starts = [
        s for s in _starts(arm, now, moving)
        if (s.kind.name, s.joint) not in there and not (_gives(s.kind) and s.joint in loose)
    ]  # fmt: skip
    beyond = _Beyond(now, np.maximum(now.rms, floor_of(arm.setup)))

    def cost(residuals: Array) -> float:
        return 0.5 * float(np.sum(np.log(np.mean(beyond(residuals) ** 2, axis=0) + 1e-12)))

    setup = replace(arm.setup, delta=now.links)
    best: dict[tuple[str, int], tuple[float, Start]] = {}
    least = cost(now.residuals)
    tell("looking for what is missing")
    left = setup.residuals_of([s.settings for s in starts])
    for start, residuals in zip(starts, left, strict=True):
        key, gain = (start.kind.name, start.joint), least - cost(residuals)
        if gain > best.get(key, (limits.least_gain, start))[0]:
            best[key] = gain, start
    ordered = sorted(best.values(), key=lambda pair: -pair[0])
    return [start for hope, start in ordered[:_TRIED] if hope > _HOPE * ordered[0][0]]


def _gives(kind: EffectKind) -> bool:
    return kind.part in (parts.HALF_PLAY, parts.COMPLIANCE)


def _starts(arm: DrivenArm, now: DrivenFit, moving: NDArray[np.bool_]) -> Iterator[Start]:
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
    names = list(dict.fromkeys([*values, *kind.part.quantities]))
    further = tuple(signed) or tuple(Moved((ROW[n], int(joint))) for n in names)
    low = np.array([q.low for q in QUANTITIES])[:, None]
    return Start(kind, int(joint), np.maximum(made, low), further)


def shown(
    arm: DrivenArm, end: DrivenFit, moving: NDArray[np.bool_], floor: Array
) -> dict[str, Array]:
    """The smallest size of each effect that would be seen, by joint; NaN: none, shape (n,).

    Args:
        arm: arm and recordings.
        end: the arm with all that was found.
        moving: joints that moved, shape (n,).
        floor: rms of the positions' noise [rad], shape (n,).
    """
    sizes = {kind.name: np.full(len(floor), np.nan) for kind in KINDS}
    beyond, setup = _Beyond(end, floor), replace(arm.setup, delta=end.links)
    starts = [s for s in _starts(arm, end, moving) if end.settings[s.size_at] == 0.0]
    left = setup.residuals_of([s.settings for s in starts])
    for start, residuals in zip(starts, left, strict=True):
        change = beyond(residuals - end.residuals)
        told = 0.5 * float(np.sum(np.log1p(np.mean(change**2, axis=0))))
        size = abs(float(start.settings[start.size_at]))
        if told >= LEAST_GAIN:
            size *= np.sqrt(LEAST_GAIN / told)
            sizes[start.kind.name][start.joint] = np.fmin(sizes[start.kind.name][start.joint], size)
    return sizes


class _Beyond:
    """What a fit's parameters can't do of residuals, in units of some rms."""

    def __init__(self, fit: DrivenFit, usual: Array) -> None:
        self._usual = usual
        self._basis = np.linalg.qr((fit.columns / usual).reshape(len(fit.columns), -1).T)[0]

    def __call__(self, residuals: Array) -> Array:
        flat = (residuals / self._usual).ravel()
        return (flat - self._basis @ (self._basis.T @ flat)).reshape(residuals.shape)
