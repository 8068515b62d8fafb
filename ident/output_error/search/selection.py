"""The arm with the parts that were accepted so far, and what each was accepted for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.fit import Fit, fit
from ident.output_error.judging import left_out, typical
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import BASE, PARTS, Part
from ident.output_error.search.screening import Places
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial
from ident.output_error.setup import Setup
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
    """The arm with what every joint has, and with the parts that its file begins with."""
    free = np.zeros(begun.may.shape, dtype=bool)
    free[[ROW[name] for name in BASE]] = True
    sizes = [ROW[name] for part in PARTS for name in part.quantities]
    free[sizes] |= begun.begins[sizes]
    found = fit(setup, begun.start, free & begun.may, begun.prior, rounds)
    return Selection(setup, found, left_out(setup, found, begun.prior))


def possible(part: Part, begun: Prepared) -> Places:
    """Joints at which a part may be: neither known nor at rest, shape (n,)."""
    return np.all(begun.may[[ROW[name] for name in part.quantities]], axis=0)


def has_place(part: Part, found: Selection) -> Places:
    """Joints that have what a part does something beside, shape (n,)."""
    beside = part.beside or "stiffness"
    return found.fit.settings[ROW[beside]] > 0.0


def clearly_off(
    errors: Array, floor: Array, resolution: Array, settings: SearchSettings
) -> NDArray[np.bool_]:
    """Joints at which more is left than what a model leaves that misses nothing, shape (n,).

    Args:
        errors: of blocks of time that are left out [rad^2], shape (B, n).
        floor: typical error of an arm of which the model misses nothing [rad], shape (n,).
        resolution: smallest step of the positions [rad], shape (n,).
        settings: numbers that decide.
    """
    off = typical(errors)
    beyond = np.sqrt(np.maximum(off**2 - floor**2, 0.0))
    return (off > settings.clear * floor) & (beyond > settings.clear_steps * resolution)


def refitted(
    found: Selection, began: Array, free: NDArray[np.bool_], changed: Sequence[Accepted],
    begun: Prepared, settings: SearchSettings,
) -> Fit:  # fmt: skip
    """The arm with the joints fitted anew that feel some parts come or go.

    Joints that another one moves by more than a step of their encoders are fitted again beside it.
    """
    setup = found.setup
    joints = np.isin(np.arange(free.shape[1]), [a.joint for a in changed])
    joints |= any(a.part.felt_elsewhere for a in changed)
    best = fit(setup, began, free & joints, begun.prior, settings.fit_rounds)
    moved = np.sqrt(np.mean((best.residuals - found.fit.residuals) ** 2, axis=0))
    if (pulled := (moved > setup.resolution) & ~joints).any():
        loose = free & (joints | pulled)
        best = fit(setup, best.settings, loose, begun.prior, settings.fit_rounds)
    return replace(best, free=free)
