"""Parts that recordings ask for, one after the other, joint by joint.

In each round every part that could explain something is put in at all joints at once and fitted
with all else; at each joint the one stays that predicts best what is left out. The servo's own come
first, since they shape the motion most; a part that joints have all or none has to help at half of
them, so that it does not stand in for what a single joint has. What gears have may be of one joint,
or of all where these have the same servos.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import explained, gain, left_out, sureness, sureness_of_all, typical
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import BASE, Part
from ident.output_error.search.screening import Places, promising
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial, trials
from ident.output_error.setup import Setup
from ident.regression.progress import Tell
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Rival:
    """Another part that explains as much.

    Attributes:
        part: what it is.
        gain: nats per sample.
    """

    part: Part
    gain: float


@dataclass(frozen=True)
class Accepted:
    """A part at a joint.

    Attributes:
        part: what it is.
        joint: from 0.
        gain: nats per sample on blocks of time that are left out.
        asked: what it needed.
        explained: rms of the positions that it explains [rad].
        next_best: the best other part there, if any helps.
        rivals: those that are not surely worse, the best first.
        of_all: whether all joints were asked together, so that this one need not be sure.
    """

    part: Part
    joint: int
    gain: float
    asked: float
    explained: float
    next_best: Rival | None
    rivals: tuple[Rival, ...]
    of_all: bool = False


@dataclass(frozen=True)
class Selection:
    """The arm with the parts that were accepted.

    Attributes:
        setup: arm and recordings, as they were searched.
        fit: with all accepted parts.
        errors: of blocks of time that are left out [rad^2], shape (B, n).
        accepted: in order of acceptance.
        gains: of each part that was tried, largest at each joint [nats per sample], shape (n,).
        tried: parts that were tried beside this arm.
        floor: typical error of an arm of which the model misses nothing [rad], shape (n,); None:
            not known yet.
    """

    setup: Setup
    fit: Fit
    errors: Array
    accepted: tuple[Accepted, ...] = ()
    gains: Mapping[Part, Array] = field(default_factory=dict)
    tried: tuple[Trial, ...] = ()
    floor: Array | None = None

    def kept(self, part: Part) -> Places:
        """Joints at which a part was accepted, shape (n,)."""
        joints = [a.joint for a in self.accepted if a.part == part]
        return np.isin(np.arange(self.errors.shape[1]), joints)


def bare(setup: Setup, begun: Prepared, rounds: int) -> Selection:
    """The arm with what every joint has."""
    free = np.zeros(begun.may.shape, dtype=bool)
    free[[ROW[name] for name in BASE]] = True
    found = fit(setup, begun.start, free & begun.may, begun.prior, rounds)
    return Selection(setup, found, left_out(setup, found, begun.prior))


def extended(
    found: Selection, begun: Prepared, parts: Sequence[Part], least: Mapping[Part, float],
    settings: SearchSettings, tell: Tell,
) -> Selection:  # fmt: skip
    """Parts added as long as what is left out is predicted better.

    Args:
        found: what is there.
        begun: arm and recordings.
        parts: what is looked for.
        least: nats per sample that a part has to bring, where it is not the settings' own.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    setup = found.setup
    for _ in range(settings.rounds):
        found = _tried(found, begun, parts, settings, tell)
        won = winners(found.tried, found.errors, least, begun, settings)
        if not won:
            break
        best = _with(found, won, begun, settings)
        errors = left_out(setup, best, begun.prior)
        if gain(found.errors, errors).sum() <= 0.0:
            break
        accepted = (*found.accepted, *won)
        found = replace(found, fit=best, errors=errors, accepted=accepted, tried=())
    return found


def possible(part: Part, begun: Prepared) -> Places:
    """Joints at which a part may be: neither known nor at rest, shape (n,)."""
    return np.all(begun.may[[ROW[name] for name in part.quantities]], axis=0)


def _tried(
    found: Selection, begun: Prepared, parts: Sequence[Part], settings: SearchSettings, tell: Tell
) -> Selection:
    """The same with what was tried beside it."""
    before = [t for t in found.tried if t.part in parts]
    new = [part for part in parts if all(t.part != part for t in before)]
    asked = {part: possible(part, begun) & ~found.kept(part) for part in new}
    tell("looking for what is missing", 0.0)
    worth = worth_a_fit(found, asked, settings, same_servo=begun.same_servo)
    args = found.setup, found.fit, found.errors, worth, begun.prior, settings, tell
    made = [*before, *trials(*args, same_servo=begun.same_servo)]
    gains = dict(found.gains)
    for t in made:
        gains[t.part] = np.maximum(gains.get(t.part, t.gain), t.gain)
    return replace(found, gains=gains, tried=tuple(made))


def worth_a_fit(
    found: Selection, asked: dict[Part, Places], settings: SearchSettings, *, same_servo: bool
) -> dict[Part, Places]:
    """Joints at which a part promises something in first order, or at which something is missing.

    Where joints stick, the first order of a part that explains most may promise nothing.
    """
    worth = promising(found.setup, found.fit, asked, settings, same_servo=same_servo)
    if found.floor is None:
        return worth
    off = typical(found.errors) > settings.clear * found.floor
    return {part: places | (asked[part] & off) for part, places in worth.items()}


def of_all_joints(part: Part, begun: Prepared) -> bool:
    """Whether a part is at all joints or at none."""
    return part.common and (begun.same_servo or part.felt_elsewhere)


def winners(
    made: Sequence[Trial], errors: Array, least: Mapping[Part, float], begun: Prepared,
    settings: SearchSettings,
) -> list[Accepted]:  # fmt: skip
    """The best part of each joint, where it is large and sure enough; the largest ones only.

    What all joints have or none is asked of all of them together, and comes first where it brings
    more than what each joint would have of its own.
    """
    own = [_by_itself(t) for t in made if not of_all_joints(t.part, begun)]
    found = []
    for joint in range(errors.shape[1]):
        ordered = sorted(
            (t for t in own if t.places[joint]),
            key=lambda t: t.gain[joint] - settings.per_quantity * t.part.further,
            reverse=True,
        )
        won = None
        while ordered and not won:
            ordered = _simpler_first(ordered, joint, settings)
            won = _accepted(ordered, joint, errors, least, begun, settings)
            # an unsure part of a servo keeps out lesser effects, but no sure part of it
            ordered = ordered[1:] if all(t.part.servo for t in ordered[:2]) else []
        found += [won] if won else []
    found.sort(key=lambda a: a.gain, reverse=True)
    servo = [a for a in found if a.part.servo]
    shared = _of_all(made, errors, least, begun, settings)
    if shared and sum(a.gain for a in shared) > sum(a.gain for a in servo):
        return shared
    if servo:
        return servo
    if found and found[0].part.felt_elsewhere:
        return found[:1]  # it may explain the others' gains
    alone = [a for a in found if not a.part.felt_elsewhere]
    return [a for a in alone if a.gain >= settings.together * alone[0].gain]


def _simpler_first(ordered: Sequence[Trial], joint: int, settings: SearchSettings) -> list[Trial]:
    """A part that is one of the first's special cases before it, unless it is surely worse."""
    first, *others = ordered
    for other in others:
        special = set(other.part.quantities) < set(first.part.quantities)
        if special and sureness(other.errors, first.errors)[joint] < settings.apart:
            return [other, *(t for t in ordered if t is not other)]
    return list(ordered)


def _by_itself(trial: Trial) -> Trial:
    """A trial whose part, if servos of one kind have it, helps no joint more than half of them."""
    if not trial.part.common:
        return trial
    return replace(trial, gain=np.minimum(trial.gain, _usual(trial)))


def _usual(trial: Trial) -> float:
    """Gain that half of the joints have, so that none speaks for all others."""
    return float(np.median(trial.gain[trial.places]))


def _of_all(
    made: Sequence[Trial], errors: Array, least: Mapping[Part, float], begun: Prepared,
    settings: SearchSettings,
) -> list[Accepted]:  # fmt: skip
    """The best of what all joints have or none, where it helps half of them; empty: nothing.

    What gears have has to be sure of all joints together, since a joint may have it by itself.
    """
    found: list[Accepted] = []
    for trial in made:
        part, usual = trial.part, _usual(trial)
        if usual < (asked := _asked(part, least, settings)):
            continue
        if not of_all_joints(part, begun):
            alike = begun.same_servo and part.gears
            if not alike or (trial.places != possible(part, begun)).any():
                continue
            if sureness_of_all(errors, trial.errors) < settings.sure:
                continue
        gains = [(int(j), float(trial.gain[j])) for j in np.flatnonzero(trial.places)]
        places = [Accepted(part, j, own, asked, 0.0, None, (), True) for j, own in gains]
        found = max(found, places, key=lambda some: sum(a.gain for a in some))
    return found


def _asked(part: Part, least: Mapping[Part, float], settings: SearchSettings) -> float:
    """Nats per sample that a part has to bring."""
    return least.get(part, settings.least_gain) + settings.per_quantity * part.further


def _accepted(
    ordered: Sequence[Trial], joint: int, errors: Array, least: Mapping[Part, float],
    begun: Prepared, settings: SearchSettings,
) -> Accepted | None:  # fmt: skip
    first = ordered[0]
    asked = _asked(first.part, least, settings)
    size = float(explained(errors, first.errors)[joint])
    sure = float(sureness(errors, first.errors)[joint])
    noise = settings.seen * begun.resolution[joint] / np.sqrt(12.0)
    if first.gain[joint] < asked or sure < settings.sure or size < noise:
        return None
    own = set(first.part.quantities)  # what holds them all and more is the same again
    others = [t for t in ordered[1:] if not own <= set(t.part.quantities)]
    names = [Rival(t.part, float(t.gain[joint])) for t in others]
    rivals = [
        r
        for r, t in zip(names, others, strict=True)
        if r.gain >= settings.rival_share * first.gain[joint]
        and sureness(t.errors, first.errors)[joint] < settings.apart
    ]
    best = names[0] if names and names[0].gain > 0.0 else None
    return Accepted(first.part, joint, float(first.gain[joint]), asked, size, best, tuple(rivals))


def _with(
    found: Selection, won: Sequence[Accepted], begun: Prepared, settings: SearchSettings
) -> Fit:
    """The arm with new parts, fitted together."""
    began, free = found.fit.settings.copy(), found.fit.free.copy()
    for a in won:
        mine = next(t for t in found.tried if t.part == a.part and t.places[a.joint])
        felt_at = slice(None) if a.part.felt_elsewhere else a.joint
        began[:, felt_at] = mine.fit.settings[:, felt_at]
        free[[ROW[name] for name in a.part.quantities], a.joint] = True
    return refitted(found.setup, began, free, won, begun, settings)


def refitted(
    setup: Setup, began: Array, free: NDArray[np.bool_], changed: Sequence[Accepted],
    begun: Prepared, settings: SearchSettings,
) -> Fit:  # fmt: skip
    """The arm with the joints fitted anew that feel some parts come or go."""
    joints = np.isin(np.arange(free.shape[1]), [a.joint for a in changed])
    loose = free & (joints | any(a.part.felt_elsewhere for a in changed))
    return replace(fit(setup, began, loose, begun.prior, settings.fit_rounds), free=free)
