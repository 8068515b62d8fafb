"""Samples that are missing, repeated, or cut off, and what is done about them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import linear_sum_assignment

from ident.checks.recorder_faults.lost_samples import repeated_and_skipped, repeats
from ident.checks.remark import Grade, Remark, joined
from ident.checks.settings import CheckSettings
from ident.model.attachments import attached_trajectory
from ident.recordings.dataset import Dataset, Parts
from ident.recordings.samples import filled
from ident.regression.probe import LEAST_SAMPLES
from wamctl.arm.recording import LogFile

_SHIFTED = 9  # samples beside a lost one that the stamps do not show: their instants are wrong


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
