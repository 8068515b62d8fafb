"""Trials that need not be made again: a part's, at joints that no round has changed since."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.output_error.prepared import Prepared
from ident.output_error.search.selection import Selection
from ident.output_error.search.trial import Trial


def still_hold(before: Selection, now: Selection, begun: Prepared) -> tuple[Trial, ...]:
    """What was tried beside one arm and holds beside another, whose other joints were changed.

    A joint that another moves by more than a step of its encoder was fitted anew, and counts as
    changed. What joints feel of each other, or have all or none, has to be tried again.

    Args:
        before: the arm, and what was tried beside it.
        now: the arm with more parts.
        begun: arm and recordings.
    """
    one, other = before.fit, now.fit
    same = np.all((one.settings == other.settings) & (one.free == other.free), axis=0)
    kept = []
    for trial in before.tried:
        part = trial.part
        alike = begun.same_servo and (part.common or part.gears)
        places = trial.places & same & (not (part.felt_elsewhere or alike))
        if places.any():
            errors = np.where(places, now.errors * trial.errors / before.errors, now.errors)
            gain = np.where(places, trial.gain, 0.0)
            kept.append(replace(trial, places=places, errors=errors, gain=gain))
    return tuple(kept)


def with_new_ones(kept: Sequence[Trial], made: Sequence[Trial]) -> list[Trial]:
    """All of them, those of one part at different joints as one."""
    found = list(made)
    for old in kept:
        alike = [k for k, t in enumerate(found) if t.part == old.part]
        if not alike or old.part.felt_elsewhere:
            found.append(old)
            continue
        new = found[alike[0]]
        settings = np.where(old.places, old.fit.settings, new.fit.settings)
        found[alike[0]] = replace(
            new,
            places=old.places | new.places,
            fit=replace(new.fit, settings=settings),
            errors=np.where(old.places, old.errors, new.errors),
            gain=np.where(old.places, old.gain, new.gain),
        )
    return found
