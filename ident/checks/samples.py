"""Samples that are missing, repeated, or cut off, and what is done about them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ident.checks.remark import Grade, Remark, joined
from ident.checks.settings import CheckSettings
from ident.model.attachments import attached_trajectory
from ident.recordings.dataset import Dataset, Parts, Segment
from ident.recordings.samples import ROUNDING, filled, smallest_step
from ident.regression.probe import LEAST_SAMPLES
from ident.signals.arrays import Array
from wamctl.arm.recording import LogFile

_BESIDE = 2
"""Steps on both sides of one from which its expected move follows."""

_SHIFTED = 9  # samples beside a lost one that the stamps do not show: their instants are wrong


@dataclass(frozen=True)
class Repeats:
    """Which samples are no readings of their own.

    Attributes:
        position: samples whose positions repeat the ones before them, shape (S,).
        torque: those of them whose torque repeats as well, shape (S,).
        skipped: number of times that a sample is missing although the stamps are even: what follows
            comes a step early. A clock that only jitters makes up for each jump beside it.
    """

    position: NDArray[np.bool_]
    torque: NDArray[np.bool_]
    skipped: int


def repeats(q: Array, tau: Array, bounds: CheckSettings) -> Repeats:
    """Samples on which all joints stand still, or jump by two samples' way, amid fast motion.

    Args:
        q: position of the joints that move [rad], shape (S, m).
        tau: their torque [N m], shape (S, m).
        bounds: of the checks.
    """
    none = np.zeros(len(q), dtype=bool)
    if len(q) < 3 * _BESIDE:
        return Repeats(none, none, 0)
    step = np.diff(q, axis=0)
    expected = 0.25 * (step[:-4] + step[1:-3] + step[3:-1] + step[4:])
    here = step[_BESIDE:-_BESIDE]
    usual = 1.5 * np.median(np.abs(here - expected), axis=0)
    typical = np.sqrt(np.mean(step**2, axis=0)) / 20.0  # of each joint: more is no error
    smallest = [smallest_step(s) for s in np.abs(step).T]
    least = np.maximum(smallest, np.minimum(usual, typical))
    fast = np.abs(expected) > bounds.fast_steps * np.maximum(least, ROUNDING)
    ratio = here / np.where(fast, expected, np.inf)
    some = fast.sum(axis=1) >= min(2, fast.shape[1])
    held = some & (~fast | (np.abs(ratio) < bounds.held_move)).all(axis=1)
    jumped = some & (~fast | (ratio > bounds.jumped_move)).all(axis=1)
    position = none.copy()
    position[_BESIDE + 1 : _BESIDE + 1 + len(held)] = held
    same = np.concatenate([[False], (np.diff(tau, axis=0) == 0).all(axis=1)])
    caught_up = np.concatenate([[False], held[:-1]])
    places = np.flatnonzero(jumped & ~caught_up) + _BESIDE
    lost = _way_gained(step, places, bounds.jitter_steps) >= bounds.way_gained
    return Repeats(position, position & same, len(places) if lost else 0)


def _way_gained(steps: Array, places: NDArray[np.intp], beside: int) -> float:
    """Way that jumps add to the motion around them, in usual steps: mean over all [1].

    Args:
        steps: from sample to sample [rad], shape (S, m).
        places: of the jumps among them.
        beside: so many steps before and after one are around it.
    """
    inside = places[(places >= beside) & (places <= len(steps) - beside)]
    around = steps[inside[:, None] + np.arange(-beside, beside)]
    usual = np.median(around, axis=1)
    way = around.sum(axis=1) - 2 * beside * usual
    weight = float(np.abs(usual).sum())
    return float((np.sign(usual) * way).sum()) / max(weight, ROUNDING)


def repeated_and_skipped(
    parts: Iterable[Segment], data: Dataset, bounds: CheckSettings
) -> tuple[int, int]:
    """How many readings repeat the one before, and samples are missing though stamps are even.

    Zero where they are so few that they may be chance, and none are missing unseen where the stamps
    are uneven: steps are longer there because the periods are.

    Args:
        parts: of the recording.
        data: the recording.
        bounds: of the checks.
    """
    found = [repeats(p.q[:, data.moving], p.tau[:, data.moving], bounds) for p in parts]
    few = max(3.0, 0.04 * bounds.lost_share * data.samples)
    counts = (sum(int(r.position.sum()) for r in found), sum(r.skipped for r in found))
    repeated, skipped = (count if count > few else 0 for count in counts)
    uneven = data.source.lost > bounds.lost_share * data.samples
    return repeated, 0 if uneven else skipped


def log_remarks(data: Sequence[Dataset]) -> list[Remark]:
    """Recordings that are too short, or given twice."""
    return _short(data) + _twice(data)


def _short(data: Sequence[Dataset]) -> list[Remark]:
    """Recordings without a stretch of which any other check could tell something."""
    advice = "Record for longer, or at a higher rate."
    told = []
    for one in data:
        longest = max((len(part.q) for _, part in one.read()), default=0)
        if longest < LEAST_SAMPLES:
            text = f"{one.name}: no more than {longest} samples follow each other (at least "
            text += f"{LEAST_SAMPLES} are needed)."
            told.append(Remark("too_short", (), text, Grade.REFUSED, advice))
    return told


def _twice(data: Sequence[Dataset]) -> list[Remark]:
    """Recordings that hold the samples of an earlier one, which then count twice."""
    told = []
    parts = [next(one.read(), (0, None))[1] for one in data]
    for i, part in enumerate(parts):
        for k, other in enumerate(parts[:i]):
            if part is None or other is None or data[i].samples != data[k].samples:
                continue
            if np.array_equal(part.q, other.q) and np.array_equal(part.tau, other.tau):
                text = f"Recording {i + 1}, {data[i].name}, holds the samples of recording {k + 1}:"
                text += " they count twice, and standard errors are too small."
                told.append(Remark("twice", (), text, Grade.DOUBTFUL, "Give each recording once."))
                break
    return told


def sample_remarks(data: Dataset, bounds: CheckSettings) -> tuple[Dataset, list[Remark]]:
    """The recording with repeated samples replaced, and what it says about its samples."""
    repeated, skipped = repeated_and_skipped((p for _, p in data.read()), data, bounds)
    remarks = [*_missing(data, repeated, skipped, bounds), *_cut(data)]
    return (_without_repeats(data, bounds) if repeated else data), remarks


def _without_repeats(data: Dataset, bounds: CheckSettings) -> Dataset:
    """The same recording with what repeats replaced by the cubic through its neighbours."""
    return replace(data, read=partial(_replaced, data, bounds))


def _replaced(data: Dataset, bounds: CheckSettings) -> Parts:
    for number, part in data.read():
        found = repeats(part.q[:, data.moving], part.tau[:, data.moving], bounds)
        q, tau = filled(part.q, found.position[:, None]), filled(part.tau, found.torque[:, None])
        yield number, replace(part, q=q, tau=tau)


def _missing(data: Dataset, repeated: int, skipped: int, bounds: CheckSettings) -> list[Remark]:
    source = data.source
    total = max(data.samples + source.lost, 1)
    told = []
    if source.lost:
        told.append(f"{source.lost} samples ({source.lost * source.period_s:.3g} s) are missing")
    if source.repeated:
        told.append(f"{source.repeated} samples repeat the previous stamp")
    if repeated:
        told.append(f"{repeated} readings repeat the previous one while the arm moves")
    if skipped:
        told.append(f"samples were lost {skipped} times although the stamps are evenly spaced")
    if not told:
        return []
    wrong = source.lost + repeated + skipped
    share = (wrong + source.repeated) / (total + source.repeated)
    harm = (wrong + _SHIFTED * skipped) / total  # a row too many costs nothing but doubt
    grade = Grade.TRUSTWORTHY if max(harm, share) < bounds.lost_share else Grade.DOUBTFUL
    grade = Grade.REFUSED if harm > bounds.lost_refused else grade
    done = "were left out or interpolated" if grade < Grade.REFUSED else "are too many for a fit"
    text = f"{data.name}: {'; '.join(told)}. They {done} ({100 * share:.3g} % of the recording)."
    advice = "Check the recorder and the bus for overload, and record again if you can."
    return [Remark("missing_data", (), text, grade, advice)]


def _cut(data: Dataset) -> list[Remark]:
    source = data.source
    if source.complete:
        return []
    there = source.spans_s[-1][1]
    file = attached_trajectory(source, data.name)
    lost = "the rest is lost"
    if file is not None and file.fundamental_rad_s:
        wanted = file.periods * 2 * np.pi / file.fundamental_rad_s
        if wanted > there:
            lost = (
                f"at least {wanted - there:.3g} s ({round((wanted - there) / source.period_s)}"
                f" samples) of its {wanted:.3g} s of excitation are lost"
            )
    text = f"{data.name} is cut off after {there:.4g} s ({data.samples} samples); {lost}."
    advice = "Let the recorder close the file, or record again."
    return [Remark("cut_log", (), text, Grade.DOUBTFUL, advice)]


def name_remarks(data: Dataset) -> list[Remark]:
    """Joints that were taken for the arm's under other names."""
    log = data.source.log
    if not isinstance(log, LogFile) or not log.renamed:
        return []
    listed = ", ".join(f"{old} as {new}" for old, new in log.renamed)
    text = f"{data.name}: joints were matched to the arm's by name: {listed}."
    return [Remark("names_matched", (), text, Grade.TRUSTWORTHY)]


def reference_remarks(data: Dataset, names: Sequence[str], bounds: CheckSettings) -> list[Remark]:
    """Reference positions, which carry no names, in another order than the joints.

    Args:
        data: the recording.
        names: of the joints.
        bounds: of the checks.
    """
    if not data.has_reference:
        return []
    n = len(data.moving)
    apart, count = np.zeros((n, n)), 0
    for _, part in data.read():
        if part.reference is not None:
            for k in range(n):
                apart[k] += np.sum((part.reference - part.q[:, [k]]) ** 2, axis=0)
            count += len(part.q)
    moving = np.flatnonzero(data.moving)
    apart = apart[np.ix_(moving, moving)] / max(count, 1)
    joint, column = linear_sum_assignment(apart)
    own, best = np.trace(apart), apart[joint, column].sum()
    if (column == joint).all() or best > bounds.believed_ratio**2 * own:
        return []
    listed = joined(
        [
            f"{names[int(moving[i])]} is in the place of {names[int(moving[j])]}"
            for i, j in zip(joint, column, strict=True)
            if i != j
        ]
    )
    text = (
        f"{data.name}: the reference positions are in a different order from the joints ({listed}),"
        " so simulations along the reference motion are wrong."
    )
    advice = "List the joints of /joint_states in the order of /joint_reference."
    return [Remark("joint_order", (), text, Grade.DOUBTFUL, advice)]
