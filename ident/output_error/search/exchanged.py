"""Joints whose columns stand in each other's place, as gravity and coupling show them.

A servo model follows any joint by another's name: what that link weighs becomes stiffness and zero.
So where the first guess's regression explains clearly more with two columns exchanged, the arm is
fitted anew in that order; it has to predict better than all that was found in the given one.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ident.output_error.first_guess import unexplained
from ident.output_error.judging import gain, sureness_of_all
from ident.output_error.parameters import ROW
from ident.output_error.prepared import Prepared, prepared, searched
from ident.output_error.search.late_start import begun_with_delay
from ident.output_error.search.selection import Selection
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import MotionSegment, Setup
from ident.signals.arrays import Array

_WORTH = 0.2
"""Nats over all joints by which the regression has to improve before a fit is spent on an order."""

_TINY = 1e-12


def exchanged_joints(
    begun: Prepared, found: Selection, settings: SearchSettings
) -> tuple[int, int] | None:
    """Two joints whose columns, commands and positions, appear to be exchanged; None: none do.

    Args:
        begun: arm and recordings.
        found: the arm with all that was found in the given order.
        settings: numbers that decide.
    """
    delay, given = found.fit.settings[ROW["delay"]], np.arange(len(begun.moving))
    now = _left(begun.setup, delay, given)
    best, least = None, -_WORTH
    for pair, order in _orders(begun):
        change = np.log(_left(begun.setup, delay, order) / now)
        if (better := float(change[begun.moving].sum())) < least:
            best, least = (pair, order), better
    if best is None:
        return None
    pair, order = best
    other = prepared(begun.arm, _in_order(begun.setup.segments, order))
    _, tried = begun_with_delay(other, searched(other.setup), settings)
    errors = tried.errors[:, order]
    helps = gain(found.errors, errors)[begun.moving].sum() > 0.0
    return pair if helps and sureness_of_all(found.errors, errors) > settings.sure else None


def _orders(begun: Prepared) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """Each pair of joints that move, and the order with them exchanged."""
    for pair in itertools.combinations(np.flatnonzero(begun.moving).tolist(), 2):
        order = np.arange(len(begun.moving))
        order[list(pair)] = pair[::-1]
        yield pair, order


def _left(setup: Setup, delay: Array, order: np.ndarray) -> Array:
    """What the regression leaves of the errors of each recorded column [rad], shape (n,)."""
    tried, zero = replace(setup, segments=_in_order(setup.segments, order)), np.zeros(len(order))
    left = [unexplained(tried, j, float(delay[k]), zero)[0] for j, k in enumerate(order)]
    return np.maximum(left, _TINY)[order]


def _in_order(segments: Sequence[MotionSegment], order: np.ndarray) -> tuple[MotionSegment, ...]:
    """Recordings whose columns are taken in another order."""
    made = []
    for s in segments:
        command = np.ascontiguousarray(s.motion.command[:, order])
        start, speed = s.motion.start[order], s.motion.speed[order]
        motion = s.motion._replace(command=command, start=start, speed=speed)
        made.append(replace(s, q=np.ascontiguousarray(s.q[:, order]), motion=motion))
    return tuple(made)
