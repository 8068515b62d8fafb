"""The search: a servo model without effects, then effects one after the other, joint by joint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, fit
from ident.output_error.identify import Prepared
from ident.output_error.missing.folds import Fold, folds
from ident.output_error.missing.judging import block_errors, explained, gain, sureness
from ident.output_error.missing.kinds import KINDS, REVERSAL, SERVO_PARTS, EffectKind
from ident.output_error.missing.nulls import Nulls, nulls
from ident.output_error.missing.screening import promising
from ident.output_error.missing.settings import GapBySimulation
from ident.output_error.missing.trial import Trial, tried
from ident.output_error.parameters import ROW
from ident.output_error.selection import chosen
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
        sureness: standard errors over blocks by which it helps.
        explained: rms of the positions that it explains [rad].
        next_best: the best other effect there, if any helps.
        rivals: those that are not surely worse, the best first.
    """

    kind: EffectKind
    joint: int
    gain: float
    asked: float
    sureness: float
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

    Args:
        begun: arm and recordings.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    parted = folds(begun.setup)
    fold = parted[0]
    asked, nominal = _asked(begun)
    wanted = begun.arm.servo.parts
    servo = [p for p in SERVO_PARTS if not wanted or p.name in wanted] + [*nominal, REVERSAL]
    base = chosen(
        fold.fitted, fold.judged, begun.start, begun.prior, begun.may, servo, begun.same_servo, tell
    ).fit
    before = block_errors(fold.judged, base.settings)
    tell("simulating the arm without effects")
    null = nulls(
        fold, base, begun.prior, asked, begun.resolution, settings.null_runs, settings.screen
    )
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
    most = max((a.gain for a in found), default=0.0)
    return [a for a in found if a.gain >= settings.together * most]


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
    if first.gain[joint] < asked or sure < settings.sure or size < noise:
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
    return Accepted(
        first.kind, joint, float(first.gain[joint]), asked, sure, size, best, tuple(rivals)
    )


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
    """

    before: tuple[Array, ...]
    after: tuple[Array, ...]
    gains: tuple[tuple[float, ...], ...]


def confirmed(found: Search, begun: Prepared, settings: GapBySimulation) -> Confirmation:
    """Every fold predicted by a fit to the others, without effects, with all, and without one."""

    def judged(start: Fit) -> tuple[Array, ...]:
        fits = (
            fit(f.fitted, start.settings, start.free, begun.prior, settings.fit_rounds)
            for f in found.folds
        )
        pairs = zip(found.folds, fits, strict=True)
        return tuple(block_errors(fold.judged, made.settings) for fold, made in pairs)

    kinds = dict.fromkeys(a.kind for a in found.accepted)
    if not kinds:
        errors = judged(found.base)
        return Confirmation(errors, errors, ())
    after = judged(found.end)
    without = {
        kind: judged(lacking(found, [a for a in found.accepted if a.kind is kind]))
        for kind in kinds
    }
    gains = tuple(
        tuple(float(gain(w, x)[a.joint]) for w, x in zip(without[a.kind], after, strict=True))
        for a in found.accepted
    )
    before = judged(found.base) if len(kinds) > 1 else next(iter(without.values()))
    return Confirmation(before, after, gains)


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
