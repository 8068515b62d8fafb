"""The fewest effects that explain as much as all that were found.

A search puts in first what explains most of what is seen so far, and one joint's effect is felt at
others: what was put in for it there stays, since what came later was fitted beside it. So the
effects are taken up once more from none, the best one first, until nothing surely better is left.
"""

from collections.abc import Sequence

from ident.output_error.fit import Fit
from ident.output_error.judging import gain, sureness, sureness_of_all
from ident.output_error.prepared import Prepared
from ident.output_error.search.confirmation import without_parts
from ident.output_error.search.selection import Accepted, Selection
from ident.output_error.search.settings import SearchSettings


def fewest(
    found: Selection, base: Fit, effects: Sequence[Accepted], begun: Prepared,
    settings: SearchSettings,
) -> Selection:  # fmt: skip
    """The arm with as few of its effects as predict about as well as all of them.

    Args:
        found: the arm with all effects.
        base: the arm before these were added.
        effects: that were found, some of which may be there for another one's sake.
        begun: arm and recordings.
        settings: numbers that decide.
    """
    kept: list[Accepted] = []
    while len(kept) + 1 < len(effects):
        others = [a for a in effects if a not in kept]
        tried = [
            (a, without_parts(found, base, [o for o in others if o is not a], begun, settings))
            for a in others
        ]
        best, made = max(tried, key=lambda pair: gain(found.errors, pair[1].errors).sum())
        if not _surely_better(found, made, settings):
            return made
        kept.append(best)
    return found


def _surely_better(one: Selection, other: Selection, settings: SearchSettings) -> bool:
    """Whether the first predicts surely better, all joints together or any of them."""
    whole = sureness_of_all(other.errors, one.errors) >= settings.apart
    return whole or bool((sureness(other.errors, one.errors) >= settings.sure).any())
