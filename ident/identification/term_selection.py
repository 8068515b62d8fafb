"""Terms on demand: those without which torque that was not fitted is predicted worse.

A term that no data ask for costs more than it brings: it fits noise, or stands in for an effect
that the model lacks. From the paper's model (3), the term that helps most is added, as long as it
lowers the held-out error of the chosen estimator by more than twice the standard error of its gain,
and by a hundredth of it. Stretches between others that were fitted do not tell whether it holds for
another motion: each recording, or each third of a single one, has to be predicted by the others no
surely worse with the term.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from ident.estimation.regression_data import RegressionData, collect
from ident.identification.cross_validation import held_out_sums, jackknife, left_out_sums
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.regression.progress import Tell, silent
from ident.regression.squared_errors import Sums, added

ON_DEMAND = "auto"
"""The word of the settings that asks for this choice."""

CANDIDATES = ("offset", "rotor_inertia")
_WORDS = {"offset": "torque offset", "rotor_inertia": "rotor inertia"}

_CLEAR = 2.0
_WORTH = 0.01
"""Part of the error that a term has to take: repeated motion makes far smaller gains look sure."""


@dataclass(frozen=True)
class Trial:
    """A term that was tried.

    Attributes:
        term: its name.
        gain_percent: what the held-out relative error over all joints falls by [percentage points].
        sd_percent: its standard error, by leaving out stretches.
        taken: whether the model has it.
        contradicted: whether it is not since the recordings, or the thirds of one, predict each
            other surely worse with it.
    """

    term: str
    gain_percent: float
    sd_percent: float
    taken: bool
    contradicted: bool = False


def with_needed_terms(
    data: Sequence[Dataset], arm: Arm, tell: Tell = silent
) -> tuple[RegressionData, tuple[Trial, ...]]:
    """The recordings, reduced for the terms that they ask for, and what was tried for the last one.

    Args:
        data: the recordings.
        arm: its settings' terms are kept; those that hold no `auto` are left as they are.
        tell: hears what is being done.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    terms = tuple(t for t in arm.settings.terms if t != ON_DEMAND)
    asked = terms != arm.settings.terms
    free = [t for t in CANDIDATES if asked and t not in terms]

    def having(more: Set[str]) -> Arm:
        return arm.with_settings(terms=(*terms, *(t for t in free if t in more)))

    sets = [set(c) for k in range(len(free) + 1) for c in combinations(free, k)]
    reducing = partial(tell, f"filtering and reducing {sum(d.samples for d in data)} samples")
    collected = collect(data, [having(s) for s in sets], reducing)
    chosen: set[str] = set()
    now, taken = collected.of(having(chosen)), []
    before = _stretches(now) if free else []
    while left := [t for t in free if t not in chosen]:
        tell(f"trying further terms: {' and '.join(_WORDS[t] for t in left)}")
        after = [collected.of(having(chosen | {t})) for t in left]
        sums = [_stretches(e) for e in after]
        trials = [trial(t, before, s) for t, s in zip(left, sums, strict=True)]
        trials = [
            _borne_out(t, now, e) if t.taken else t for t, e in zip(trials, after, strict=True)
        ]
        best = int(np.argmax([t.gain_percent if t.taken else -np.inf for t in trials]))
        if not trials[best].taken:
            return now, (*taken, *trials)
        taken.append(trials[best])
        chosen, now, before = chosen | {left[best]}, after[best], sums[best]
    return now, tuple(taken)


def _borne_out(tried: Trial, without: RegressionData, having: RegressionData) -> Trial:
    """A term that is not taken if recordings surely predict each other worse with it."""
    name = having.arm.settings.estimator
    before, after = (left_out_sums(e, name) for e in (without, having))
    value, sd = jackknife(_gain, before, after)
    worse = value < -_CLEAR * sd
    return replace(tried, taken=not worse, contradicted=worse)


def trial(term: str, before: Sequence[Sums], after: Sequence[Sums]) -> Trial:
    """A term by what each stretch's error is without it and with it, none of them fitted on."""
    value, sd = jackknife(_gain, before, after)
    least = _WORTH * added(before).errors().relative_percent
    return Trial(term, value, sd, value > max(_CLEAR * sd, least))


def _gain(before: Sums, after: Sums) -> float:
    """By how much the error over all joints falls [percentage points]."""
    return before.errors().relative_percent - after.errors().relative_percent


def _stretches(evidence: RegressionData) -> list[Sums]:
    return held_out_sums(evidence, evidence.arm.settings.estimator)
