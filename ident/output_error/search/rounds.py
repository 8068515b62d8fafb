"""Parts that recordings ask for, one after the other, joint by joint.

In each round every part that could explain something is put in at all joints at once and fitted
with all else; at each joint the one stays that predicts best what is left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import gain, left_out, typical
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared, searched
from ident.output_error.search.again import still_hold, with_new_ones
from ident.output_error.search.parts import Part
from ident.output_error.search.screening import Places, promising
from ident.output_error.search.selection import (
    Accepted,
    Selection,
    clearly_off,
    has_place,
    possible,
    refitted,
)
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial, trials
from ident.output_error.search.winners import winners
from ident.regression.progress import Tell


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
    for _ in range(settings.rounds):
        found = _tried(found, begun, parts, settings, tell)
        won, beside = winners(found.tried, found.errors, least, begun, settings), found
        if not won:
            won, beside = _beside_a_servos_part(found, begun, parts, least, settings, tell)
        if not won:
            break
        better = _put_in(beside, won, begun, settings)
        if gain(found.errors, better.errors).sum() <= 0.0:
            break
        found = better
    return found


def of_servos(
    base: Selection, begun: Prepared, parts: Sequence[Part], settings: SearchSettings, tell: Tell
) -> Selection:
    """The arm with its servos' own parts, seen in as much as the search for all others sees.

    The first are found at a glance; what that leaves unsure is looked for in all that is searched.

    Args:
        base: the arm with what every joint has, and what tells of servos.
        begun: arm and recordings.
        parts: what servos may have.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    found, setup = extended(base, begun, parts, {}, settings, tell), searched(begun.setup)
    if found.setup.seconds == setup.seconds:
        return found
    best = fit(setup, found.fit.settings, found.fit.free, begun.prior, settings.fit_rounds)
    errors = left_out(setup, best, begun.prior)
    seen = replace(found, setup=setup, fit=best, errors=errors, tried=())
    return extended(seen, begun, parts, {}, settings, tell)


def _beside_a_servos_part(
    found: Selection, begun: Prepared, parts: Sequence[Part], least: Mapping[Part, float],
    settings: SearchSettings, tell: Tell,
) -> tuple[list[Accepted], Selection]:  # fmt: skip
    """What wins beside an unsure part of a servo, at joints where something is left.

    A servo at its limit and an effect at the same joint hide each other: alone neither explains
    much. So the servo's part is put in where it helps at all, and stays where an effect is sure
    beside it.
    """
    if found.floor is None:
        return [], found
    off = clearly_off(found.errors, found.floor, begun.resolution, settings)
    effects = [p for p in parts if not p.servo]
    for trial in found.tried:
        places = off & trial.places & (trial.gain > settings.least_gain)
        if not trial.part.servo or trial.part.common or not places.any():
            continue
        put = [_unsure(trial, int(j), settings) for j in np.flatnonzero(places)]
        beside = replace(_put_in(found, put, begun, settings), tried=())
        beside = _tried(beside, begun, effects, settings, tell, within=places)
        won = winners(beside.tried, beside.errors, least, begun, settings)
        if won:
            joints = {a.joint for a in won}
            stays = [a for a in put if a.joint in joints]
            made = beside.tried
            return won, replace(_put_in(found, stays, begun, settings), tried=made)
    return [], found


def _unsure(trial: Trial, joint: int, settings: SearchSettings) -> Accepted:
    own = float(trial.gain[joint])
    return Accepted(trial.part, joint, own, settings.least_gain, 0.0, None, ())


def _put_in(
    found: Selection, added: Sequence[Accepted], begun: Prepared, settings: SearchSettings
) -> Selection:
    """The arm with some of the parts that were tried beside it."""
    best = _with(found, added, begun, settings)
    errors = left_out(found.setup, best, begun.prior)
    accepted = (*found.accepted, *added)
    put = replace(found, fit=best, errors=errors, accepted=accepted)
    return replace(put, tried=still_hold(found, put, begun))


def _tried(
    found: Selection, begun: Prepared, parts: Sequence[Part], settings: SearchSettings, tell: Tell,
    within: Places | bool = True,
) -> Selection:  # fmt: skip
    """The same with what was tried beside it, at some joints."""
    before = [t for t in found.tried if t.part in parts]
    asked = {p: possible(p, begun) & has_place(p, found) & ~found.kept(p) & within for p in parts}
    tell("looking for what is missing", 0.0)
    worth = worth_a_fit(found, asked, settings, same_servo=begun.same_servo)
    for t in before:
        worth[t.part] &= ~t.places & (not t.part.felt_elsewhere)
    args = found.setup, found.fit, found.errors, worth, begun.prior, settings, tell
    made = with_new_ones(before, trials(*args, same_servo=begun.same_servo))
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
    return refitted(found, began, free, won, begun, settings)
