"""Recordings parted for the search: pieces to fit, and pieces, or whole motions, that judge."""

from dataclasses import dataclass, replace

from ident.output_error.fit import Setup
from ident.output_error.recordings import parted

FOLDS = 3
PIECE_S = 8.0
LONGEST_S = 240.0
"""More than this tells the search little and takes long."""

STEP_S = 0.002
"""With 4 ms, backlash passed for a compliance."""


@dataclass(frozen=True)
class Fold:
    """Pieces to fit, and the others, which judge."""

    fitted: Setup
    judged: Setup


def folds(setup: Setup) -> tuple[Fold, ...]:
    """The recordings in three ways; a recording is left out whole where there are three or more."""
    names = list(dict.fromkeys(s.name for s in setup.segments))
    cut = parted(setup.segments, PIECE_S)
    stride = max(round(len(cut) * PIECE_S / LONGEST_S), 1)
    thin = cut[::stride]
    whole = len(names) >= FOLDS and {s.name for s in thin} == set(names)
    place = {name: i for i, name in enumerate(names)}
    side = [place[s.name] % FOLDS if whole else i % FOLDS for i, s in enumerate(thin)]
    coarse = replace(setup, step=max(setup.step, STEP_S))
    return tuple(
        Fold(
            replace(coarse, segments=tuple(s for s, i in zip(thin, side, strict=True) if i != k)),
            replace(coarse, segments=tuple(s for s, i in zip(thin, side, strict=True) if i == k)),
        )
        for k in reversed(range(FOLDS))
    )
