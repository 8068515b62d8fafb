"""Readings that repeat the one before, and readings that are missing though the stamps are even.

A recorder that asks for the latest reading more rarely than the arm has new ones passes over some
now and then. Its stamps hold all the same, to within a period of the arm's, and no time is lost:
the recorded velocities tell of the way that the positions go. Where samples were dropped and the
others stamped evenly, the positions go further.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.checks.recorder_faults.velocities import unbroken
from ident.checks.settings import CheckSettings
from ident.recordings.dataset import Dataset, Segment
from ident.recordings.samples import ROUNDING, smallest_step
from ident.signals.arrays import Array

_BESIDE = 2
"""Steps on both sides of one from which its expected move follows."""


@dataclass(frozen=True)
class Repeats:
    """Which samples are no readings of their own.

    Attributes:
        position: samples whose positions repeat the ones before them, shape (S,).
        torque: those of them whose torque repeats as well, shape (S,).
        skipped: steps in which a sample is missing although the stamps are even: what follows comes
            a step early. A clock that only jitters makes up for each jump beside it.
    """

    position: NDArray[np.bool_]
    torque: NDArray[np.bool_]
    skipped: NDArray[np.intp]


def repeats(q: Array, tau: Array, bounds: CheckSettings) -> Repeats:
    """Samples on which all joints stand still, or jump by two samples' way, amid fast motion.

    Args:
        q: position of the joints that move [rad], shape (S, m).
        tau: their torque [N m], shape (S, m).
        bounds: of the checks.
    """
    none = np.zeros(len(q), dtype=bool)
    if len(q) < 3 * _BESIDE:
        return Repeats(none, none, np.zeros(0, dtype=np.intp))
    step = np.diff(q, axis=0)
    held, places = _held_and_jumped(step, bounds)
    position = none.copy()
    position[1:] = held
    same = np.concatenate([[False], (np.diff(tau, axis=0) == 0).all(axis=1)])
    lost = _way_gained(step, None, places, bounds.jitter_steps) >= bounds.way_gained
    return Repeats(position, position & same, places if lost else places[:0])


def _held_and_jumped(
    step: Array, bounds: CheckSettings
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Steps on which all joints stand amid fast motion, shape (S,), and the places of jumps."""
    expected = 0.25 * (step[:-4] + step[1:-3] + step[3:-1] + step[4:])
    here = step[_BESIDE:-_BESIDE]
    usual = 1.5 * np.median(np.abs(here - expected), axis=0)
    typical = np.sqrt(np.mean(step**2, axis=0)) / 20.0  # of each joint: more is no error
    smallest = [smallest_step(s) for s in np.abs(step).T]
    least = np.maximum(smallest, np.minimum(usual, typical))
    fast = np.abs(expected) > bounds.fast_steps * np.maximum(least, ROUNDING)
    ratio = here / np.where(fast, expected, np.inf)
    some = fast.sum(axis=1) >= min(2, fast.shape[1])
    held = np.zeros(len(step), dtype=bool)
    held[_BESIDE:-_BESIDE] = some & (~fast | (np.abs(ratio) < bounds.held_move)).all(axis=1)
    jumped = some & (~fast | (ratio > bounds.jumped_move)).all(axis=1)
    places = np.flatnonzero(jumped) + _BESIDE
    return held, places[~held[places - 1]]  # after one that stood, a jump makes up for it


def _way_gained(steps: Array, told: Array | None, places: NDArray[np.intp], beside: int) -> float:
    """Way that jumps add to the motion around them, in usual steps: mean over all [1].

    Args:
        steps: from sample to sample [rad], shape (S, m).
        told: the way that velocities tell of meanwhile [rad], shape (S, m); None: as the steps
            around.
        places: of the jumps among them.
        beside: so many steps before and after one are around it.
    """
    inside = places[(places >= beside) & (places <= len(steps) - beside)]
    around = inside[:, None] + np.arange(-beside, beside)
    usual = np.median((steps if told is None else told)[around], axis=1)
    way = steps[around].sum(axis=1) - 2 * beside * usual
    weight = float(np.abs(usual).sum())
    return float((np.sign(usual) * way).sum()) / max(weight, ROUNDING)


def _passed_over(data: Dataset, at_s: Array, bounds: CheckSettings) -> bool:
    """Whether readings were passed over only: by recorded velocities, no way is gained by them.

    A median of velocities is asked, since those that were formed of the positions jump as these.

    Args:
        data: the recording.
        at_s: when readings are missing [s], shape (K,).
        bounds: of the checks.
    """
    gained = []
    for t, q, qd in unbroken(data.source, range(len(data.source.joint_names))):
        steps, told = np.diff(q, axis=0), qd[1:] * np.diff(t)[:, None]
        places = np.searchsorted(t, at_s[(at_s >= t[0]) & (at_s < t[-1])], side="right") - 1
        gained += [_way_gained(steps, told, places, bounds.jitter_steps)] * len(places)
    return len(gained) > 0 and bool(abs(np.mean(gained)) < bounds.way_gained)


def repeated_and_skipped(
    parts: Iterable[Segment], data: Dataset, bounds: CheckSettings
) -> tuple[int, int]:
    """How many readings repeat the one before, and samples are missing though stamps are even.

    Zero where they are so few that they may be chance. None are missing unseen where the stamps are
    uneven: steps are longer there because the periods are.

    Args:
        parts: of the recording.
        data: the recording.
        bounds: of the checks.
    """
    pairs = [(p, repeats(p.q[:, data.moving], p.tau[:, data.moving], bounds)) for p in parts]
    few = max(3.0, 0.04 * bounds.lost_share * data.samples)
    repeated = sum(int(r.position.sum()) for _, r in pairs)
    at_s = (p.start_s + (r.skipped + 0.5) / data.rate_hz for p, r in pairs)
    skipped_s = np.concatenate([np.zeros(0), *at_s])
    uneven = data.source.lost > bounds.lost_share * data.samples
    lost = len(skipped_s) > few and not uneven and not _passed_over(data, skipped_s, bounds)
    return repeated if repeated > few else 0, len(skipped_s) if lost else 0
