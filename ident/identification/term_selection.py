"""Terms on demand: those without which torque that was not fitted is predicted worse.

A term that no data ask for costs more than it brings: it fits noise, or stands in for an effect
that the model lacks. From the paper's model (3), the term that helps most is added, as long as it
lowers the held-out error of the chosen estimator by more than twice the standard error of its gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ident.estimation.regression_data import Progress, reduce_recordings
from ident.identification.cross_validation import held_out_sums, jackknife
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.regression.progress import Tell, silent
from ident.regression.squared_errors import Sums

ON_DEMAND = "auto"
"""The word of the settings that asks for this choice."""

CANDIDATES = ("offset", "rotor_inertia")
_WORDS = {"offset": "torque offset", "rotor_inertia": "rotor inertia"}

_CLEAR = 2.0


@dataclass(frozen=True)
class Trial:
    """A term that was tried.

    Attributes:
        term: its name.
        gain_percent: what the held-out relative error over all joints falls by [percentage points].
        sd_percent: its standard error, by leaving out stretches.
        taken: whether the model has it.
    """

    term: str
    gain_percent: float
    sd_percent: float
    taken: bool


def with_needed_terms(
    data: Sequence[Dataset], arm: Arm, tell: Tell = silent
) -> tuple[Arm, tuple[Trial, ...]]:
    """The arm with the terms that the recordings ask for, and what was tried for the last one.

    Args:
        data: the recordings.
        arm: its settings' terms are kept; those that hold no `auto` are left as they are.
        tell: hears what is being done.
    """
    terms = tuple(t for t in arm.settings.terms if t != ON_DEMAND)
    if terms == arm.settings.terms:
        return arm, ()
    arm, taken = arm.with_settings(terms=terms), []
    before = _stretches(data, arm, partial(tell, "trying the terms as they are"))
    while left := [t for t in CANDIDATES if t not in arm.settings.terms]:
        arms = [arm.with_settings(terms=(*arm.settings.terms, t)) for t in left]
        hears = [partial(tell, f"trying a further term: {_WORDS[t]}") for t in left]
        after = [_stretches(data, a, h) for a, h in zip(arms, hears, strict=True)]
        trials = [_trial(t, before, a) for t, a in zip(left, after, strict=True)]
        best = int(np.argmax([t.gain_percent for t in trials]))
        if not trials[best].taken:
            return arm, (*taken, *trials)
        taken.append(trials[best])
        arm, before = arms[best], after[best]
    return arm, tuple(taken)


def _stretches(data: Sequence[Dataset], arm: Arm, progress: Progress) -> list[Sums]:
    return held_out_sums(reduce_recordings(data, arm, progress), arm.settings.estimator)


def _trial(term: str, before: Sequence[Sums], after: Sequence[Sums]) -> Trial:
    def gain(a: Sums, b: Sums) -> float:
        return a.errors().relative_percent - b.errors().relative_percent

    value, sd = jackknife(gain, before, after)
    return Trial(term, value, sd, value > _CLEAR * sd)
