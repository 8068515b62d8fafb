"""Which of the parts that were tried are accepted, joint by joint.

The servo's own come first, since they shape the motion most; a part that joints have all or none
has to help at half of them, so that it does not stand in for what a single joint has. What gears
have may be of one joint, or of all where these have the same servos.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ident.output_error.judging import explained, sureness, sureness_of_all
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import Part
from ident.output_error.search.selection import Accepted, Rival, possible
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial
from ident.signals.arrays import Array


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
            (t for t in own if t.places[joint] and not t.is_nothing(joint)),
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
