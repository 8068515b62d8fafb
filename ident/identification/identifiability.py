"""What the data can tell, and what they cannot."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.dynamics.base_parameters import BaseMap
from ident.identification.standard_errors import QUANTILE_90
from ident.signals.arrays import Array

_WEAK = 0.02
_TAKES_PART = 0.3


@dataclass(frozen=True)
class Identifiability:
    """The limits of an identification.

    Attributes:
        without_effect: standard parameters that no torque of the moving joints depends on.
        only_combined: standard parameters that show up only inside combinations.
        invisible: base parameters whose 90 % interval holds zero.
        confused: groups of base parameters that this motion hardly tells apart.
    """

    without_effect: tuple[str, ...]
    only_combined: tuple[str, ...]
    invisible: tuple[str, ...]
    confused: tuple[tuple[str, ...], ...]


def identifiability(base: BaseMap, R: Array, beta: Array, sd: Array) -> Identifiability:
    """What could not be identified.

    Args:
        base: the base parameters.
        R: triangle of [W | tau], shape (b + 1, b + 1).
        beta: the OLS solution, shape (b,).
        sd: its standard errors, shape (b,).
    """
    effect = np.any(base.K != 0, axis=0)
    alone = np.count_nonzero(base.K, axis=1) == 1
    clean = {int(np.flatnonzero(row)[0]) for row in base.K[alone]}
    names = [p.name for p in base.parameters]
    return Identifiability(
        without_effect=tuple(n for n, e in zip(names, effect, strict=True) if not e),
        only_combined=tuple(n for i, n in enumerate(names) if effect[i] and i not in clean),
        invisible=tuple(
            n for n, x, s in zip(base.names, beta, sd, strict=True) if abs(x) < QUANTILE_90 * s
        ),
        confused=confusions(R, base.names),
    )


def confusions(R: Array, names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Names of nearly dependent columns, the worst group first.

    Args:
        R: triangle of [W | tau], shape (b + 1, b + 1).
        names: of the b columns.
    """
    R1 = R[:-1, :-1]
    _, singular, directions = np.linalg.svd(R1 / np.linalg.norm(R1, axis=0))
    found = []
    for value, direction in zip(singular[::-1], directions[::-1], strict=True):
        if value > _WEAK * singular[0]:
            break
        part = np.flatnonzero(np.abs(direction) > _TAKES_PART)
        found.append(tuple(names[int(i)] for i in part))
    return tuple(found)
