"""The search: a servo model without effects, then effects one after the other, joint by joint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, fit
from ident.output_error.identify import Prepared
from ident.output_error.missing.folds import Fold, folds
from ident.output_error.missing.judging import block_errors, explained, gain, sureness, typical
from ident.output_error.missing.kinds import KINDS, SERVO_PARTS, EffectKind
from ident.output_error.missing.nulls import Nulls, nulls
from ident.output_error.missing.screening import promising
from ident.output_error.missing.settings import GapBySimulation
from ident.output_error.missing.trial import Trial, tried
from ident.output_error.parameters import ROW
from ident.output_error.selection import Chosen, Part, chosen
from ident.regression.progress import Tell
from ident.signals.arrays import Array

Places = NDArray[np.bool_]


@dataclass(frozen=True)
class Rival:
    """Another effect that explains as much.

    Attributes:
        name: its id.
        gain: nats per sample.
    """

    name: str
    gain: float


@dataclass(frozen=True)
class Accepted:
    """An effect at a joint.

    Attributes:
        kind: the effect.
        joint: from 0.
        gain: held-out nats per sample.
        asked: what it needed.
        explained: rms of the positions that it explains [rad].
        next_best: the best other effect there, if any helps.
        rivals: those that are not surely worse, the best first.
    """

    kind: EffectKind
    joint: int
    gain: float
    asked: float
    explained: float
    next_best: Rival | None
    rivals: tuple[Rival, ...]


@dataclass(frozen=True)
class Search:
    """What a search ends with.

    Attributes:
        folds: the recordings' parts; the first was searched.
        base: the arm without effects, on the first fold.
        end: with all accepted effects.
        accepted: in order of acceptance.
        nulls: of the effect-free simulations.
        before, after: errors on the first fold's judging pieces, shape (B, n).
        asked: joints at which each effect was looked for.
    """

    folds: tuple[Fold, ...]
    base: Fit
    end: Fit
    accepted: tuple[Accepted, ...]
    nulls: Nulls
    before: Array
    after: Array
    asked: dict[EffectKind, Places]


def search(begun: Prepared, settings: GapBySimulation, tell: Tell) -> Search:
    """Effects that held-out motions ask for.

    Where error is left that none explains, a servo that plans its motion may have been taken in the
    place of an effect and a torque limit: the search begins again without it, and what predicts
    better stays.

    Args:
        begun: arm and recordings.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    parted = folds(begun.setup)
    asked, nominal = _asked(begun)
    wanted = begun.arm.servo.parts
    servo = [p for p in SERVO_PARTS if not wanted or p.name in wanted] + nominal
    base = _servo(parted[0], servo, begun, tell)
    tell("simulating the arm without effects")
    args = begun.prior, asked, begun.resolution, settings.null_runs, settings.screen
    null = nulls(parted[0], base.fit, *args)
    found = _added(parted, base.fit, null, asked, begun, settings, tell)
    open_ = unexplained(found.before, found.after, null.typical, begun, settings)
    taken = {t.name for t in base.trials if t.kept[open_].any()}
    without = [p for p in servo if not (p.rival and p.name in taken)]
    if without == servo:
        return found
    other = _servo(parted[0], without, begun, tell)
    again = _added(parted, other.fit, null, asked, begun, settings, tell)
    return again if gain(found.after, again.after)[open_].sum() > settings.least_gain else found


def _servo(fold: Fold, parts: Sequence[Part], begun: Prepared, tell: Tell) -> Chosen:
    """The arm without effects."""
    args = begun.start, begun.prior, begun.may, parts, begun.same_servo, tell
    return chosen(fold.fitted, fold.judged, *args)


def _added(
    parted: tuple[Fold, ...], base: Fit, null: Nulls, asked: dict[EffectKind, Places],
    begun: Prepared, settings: GapBySimulation, tell: Tell,
) -> Search:  # fmt: skip
    """Effects added to a base as long as held-out motions ask for them."""
    fold = parted[0]
    before = block_errors(fold.judged, base.settings)
    best, errors, accepted = base, before, []
    for _ in range(settings.rounds):
        trials = _round(fold, best, errors, asked, accepted, begun, settings, tell)
        found = _winners(trials, errors, null, begun.resolution, settings)
        if not found:
            break
        best = _with(fold, best, trials, found, begun, settings)
        accepted += found
        errors = block_errors(fold.judged, best.settings)
    return Search(parted, base, best, tuple(accepted), null, before, errors, asked)


def unexplained(
    before: Array, after: Array, floor: Array, begun: Prepared, settings: GapBySimulation
) -> Places:
    """Joints at which error is left that no effect explains, shape (n,).

    Args:
        before: errors by block without effects, shape (B, n).
        after: likewise with them.
        floor: of the typical block of a model that misses nothing [rad], shape (n,).
        begun: arm and recordings.
        settings: numbers that decide.
    """
    rest = typical(after) ** 2 - floor**2
    seen = np.sqrt(rest.clip(0.0)) > settings.clear_steps * begun.resolution
    clear = (typical(after) > settings.clear * floor) & seen & begun.moving
    return clear & (share_left(before, after, floor) > settings.unclosed)


def share_left(before: Array, after: Array, floor: Array) -> Array:
    """Share of each joint's gap that is left beside all effects, shape (n,)."""
    gap, rest = (typical(errors) ** 2 - floor**2 for errors in (before, after))
    return np.clip(rest / np.maximum(gap, rest.clip(1e-300)), 0.0, 1.0)


def _asked(begun: Prepared) -> tuple[dict[EffectKind, Places], list]:
    """Where each effect is looked for, and parts of the servo model that are none here.

    What the arm's file fixes is known. What it lists among the servo's parts, and a zero, is a
    part of the servo model: the file says that it is there.
    """
    asked, nominal = {}, []
    for kind in KINDS:
        rows = [ROW[name] for name in kind.part.quantities]
        places = begun.may[rows].all(axis=0)
        if kind.part.name == "zero" and "zero" in begun.arm.servo.parts:
            nominal.append(kind.part)
        elif places.any():
            asked[kind] = places
    return asked, nominal


def _round(
    fold: Fold, best: Fit, errors: Array, asked: dict[EffectKind, Places],
    accepted: Sequence[Accepted], begun: Prepared, settings: GapBySimulation, tell: Tell,
) -> list[Trial]:  # fmt: skip
    tell("looking for effects", 0.0)
    left = {}
    for kind, places in asked.items():
        left[kind] = places.copy()
        left[kind][[a.joint for a in accepted if a.kind is kind]] = False
    trials, worth = [], promising(fold.fitted, best, left, settings.screen)
    for i, (kind, places) in enumerate(worth.items()):
        tell(f"trying {kind.name.replace('_', ' ')}", i / len(asked))
        if places.any():
            args = fold, best, errors, kind, places, begun.prior, settings.fit_rounds
            trials.append(tried(*args))
    return trials


def _winners(
    trials: Sequence[Trial], errors: Array, null: Nulls, resolution: Array,
    settings: GapBySimulation,
) -> list[Accepted]:  # fmt: skip
    """The best effect of each joint, where it is large and sure enough; the largest ones only."""
    found = []
    for joint in range(errors.shape[1]):
        ordered = sorted(
            (t for t in trials if t.places[joint]),
            key=lambda t: t.gain[joint] - settings.per_quantity * t.kind.further,
            reverse=True,
        )
        if ordered and (won := _accepted(ordered, joint, errors, null, resolution, settings)):
            found.append(won)
    found.sort(key=lambda a: a.gain, reverse=True)
    far = [a for a in found if a.kind.felt_elsewhere]  # the best may explain the others' gains
    alone = [a for a in found if a not in far[1:]]
    return [a for a in alone if a.gain >= settings.together * alone[0].gain]


def _accepted(
    ordered: Sequence[Trial], joint: int, errors: Array, null: Nulls, resolution: Array,
    settings: GapBySimulation,
) -> Accepted | None:  # fmt: skip
    first = ordered[0]
    asked = max(settings.least_gain, settings.null_factor * null.gain[first.kind.name])
    asked += settings.per_quantity * first.kind.further
    size = float(explained(errors, first.errors)[joint])
    sure = float(sureness(errors, first.errors)[joint])
    noise = settings.seen * resolution[joint] / np.sqrt(12.0)
    if first.gain[joint] < asked or sure < settings.hint or size < noise:
        return None
    own = set(first.kind.part.quantities)  # what holds them all and more is the same again
    others = [t for t in ordered[1:] if not own <= set(t.kind.part.quantities)]
    names = [Rival(t.kind.name, float(t.gain[joint])) for t in others]
    rivals = [
        r
        for r, t in zip(names, others, strict=True)
        if r.gain >= settings.rival_share * first.gain[joint]
        and sureness(t.errors, first.errors)[joint] < settings.apart
    ]
    best = names[0] if names and names[0].gain > 0.0 else None
    return Accepted(first.kind, joint, float(first.gain[joint]), asked, size, best, tuple(rivals))


def _with(
    fold: Fold, best: Fit, trials: Sequence[Trial], found: Sequence[Accepted], begun: Prepared,
    settings: GapBySimulation,
) -> Fit:  # fmt: skip
    """The arm with new effects, fitted together."""
    began, free = best.settings.copy(), best.free.copy()
    for a in found:
        mine = next(t for t in trials if t.kind is a.kind)
        began[:, a.joint] = mine.fit.settings[:, a.joint]
        free[[ROW[name] for name in a.kind.part.quantities], a.joint] = True
    return fit(fold.fitted, began, free, begun.prior, settings.fit_rounds)


@dataclass(frozen=True)
class Confirmation:
    """Errors of all folds, each predicted by fits to the others.

    Attributes:
        before, after: without and with the effects, a fold each, shape (B, n).
        gains: of each accepted effect beside all others, on each fold.
        sureness: standard errors over the blocks of all folds by which each of them helps.
    """

    before: tuple[Array, ...]
    after: tuple[Array, ...]
    gains: tuple[tuple[float, ...], ...]
    sureness: tuple[float, ...]


def confirmed(found: Search, begun: Prepared, settings: GapBySimulation) -> Confirmation:
    """Every fold predicted by a fit to the others, without effects, with all, and without one."""

    def judged(start: Fit) -> tuple[Array, ...]:
        fits = (
            fit(f.fitted, start.settings, start.free, begun.prior, settings.fit_rounds)
            for f in found.folds
        )
        pairs = zip(found.folds, fits, strict=True)
        return tuple(block_errors(fold.judged, made.settings) for fold, made in pairs)

    if not found.accepted:
        errors = judged(found.base)
        return Confirmation(errors, errors, (), ())
    after = judged(found.end)
    groups = [_together(a, found.accepted) for a in found.accepted]
    without = {group: judged(lacking(found, group)) for group in dict.fromkeys(groups)}
    pairs = [(a.joint, without[group]) for a, group in zip(found.accepted, groups, strict=True)]
    gains = tuple(
        tuple(float(gain(w, x)[j]) for w, x in zip(errors, after, strict=True))
        for j, errors in pairs
    )
    sure = tuple(
        float(sureness(np.concatenate(errors), np.concatenate(after))[j]) for j, errors in pairs
    )
    before = judged(found.base) if len(without) > 1 else next(iter(without.values()))
    return Confirmation(before, after, gains, sure)


def _together(effect: Accepted, accepted: Sequence[Accepted]) -> tuple[Accepted, ...]:
    """Effects that can be taken out at once with this one: none is felt at another's joint."""
    alike = (a for a in accepted if a.kind is effect.kind)
    return (effect,) if effect.kind.felt_elsewhere else tuple(alike)


def lacking(found: Search, effects: Sequence[Accepted]) -> Fit:
    """The arm without some of its effects; without all of them it is the one they began with."""
    if len(effects) == len(found.accepted):
        return found.base
    settings, free = found.end.settings.copy(), found.end.free.copy()
    for a in effects:
        rows = [ROW[q] for q in a.kind.part.quantities]
        settings[rows, a.joint] = found.base.settings[rows, a.joint]
        free[rows, a.joint] = False
    return replace(found.end, settings=settings, free=free)
