"""Which effects the positions of an arm that torque drives ask for, one after the other.

Every effect is put in at every joint, at a few sizes, and all that the base parameters can do of
it is taken off, in first order; what promises most is fitted with all else. It stays where it
predicts best what is left out, beside whatever else explains as much.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.driven.columns import DrivenArm, Moved
from ident.output_error.driven.fit import DrivenFit, fitted, floor_of, left_out
from ident.output_error.driven.starts import LEAST_GAIN, Beyond, Start, gives, starts_of
from ident.output_error.judging import BLOCK_S, sureness_of_all
from ident.output_error.parameters import ROW
from ident.output_error.search.settings import SearchSettings
from ident.regression.progress import Tell
from ident.signals.arrays import Array

_TURNING = {"presliding": 1e-4, "turning_speed": 2e-3}
"""Friction turns round gradually, nobody knows how; a fit begins with next to nothing [rad, s]."""

_TRIED = 3
TRIAL_ROUNDS = 2
"""Times that columns are formed where an effect is only tried."""

_HOPE = 0.3  # of the best promise: less is tried where nothing else is sure


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
        done: list[Tried] = []
        for k, (hope, start) in enumerate(hopes):
            if hope < _HOPE * hopes[0][0] and any(_is_sure(t, limits) for t in done):
                break
            tell("fitting what is missing", k / len(hopes))
            further = (*now.further, *start.further)
            fit = fitted(arm, now.beta, start.settings, further, rounds=TRIAL_ROUNDS)
            done.append(_judged(arm, start, fit, found.left, group))
        sure = [t for t in done if _is_sure(t, limits)]
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


def _is_sure(tried: Tried, limits: SearchSettings) -> bool:
    return tried.gain > LEAST_GAIN and tried.sure > limits.sure


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
) -> list[tuple[float, Start]]:  # fmt: skip
    """What promises most in first order [nats per sample], one start of each effect and joint."""
    there = {(s.tried.start.kind.name, s.tried.start.joint) for s in found.steps}
    loose = {s.tried.start.joint for s in found.steps if gives(s.tried.start.kind)}
    starts = [
        s for s in starts_of(arm, now, moving)
        if (s.kind.name, s.joint) not in there and not (gives(s.kind) and s.joint in loose)
    ]  # fmt: skip
    beyond = Beyond(now, np.maximum(now.rms, floor_of(arm.setup)))

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
    return sorted(best.values(), key=lambda pair: -pair[0])[:_TRIED]
