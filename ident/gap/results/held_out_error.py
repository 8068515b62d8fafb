"""Held-out error of the nominal model and of the model with effects, beside the pure error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.blocks import EXCLUDED, HELD_OUT
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.repeatability import pure_error
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.weighted_fit import fit
from ident.gap.results.outcome import SearchResult
from ident.signals.arrays import Array

_NEGLIGIBLE = 0.02  # of the gap: smaller shares are not listed


@dataclass(frozen=True)
class Errors:
    """Errors on some rows, without reversals.

    At standstill dry friction takes any value that holds the joint, which the motion does not show.
    Effects at reversals show in `closed` and in the forward simulation.

    Attributes:
        relative_percent: rms residual over rms torque [%].
        rms: per joint [N m], shape (n,); not-a-number for held joints.
    """

    relative_percent: float
    rms: Array


@dataclass(frozen=True)
class BeforeAfter:
    """The same rows with the nominal model and with the effects.

    Attributes:
        design: with the effects' columns.
        before, after: residuals of all rows, from fits on the searched folds.
        floor: pure error per joint and region [N m], shape (n, regions), or None.
    """

    design: DesignMatrix
    before: list[Residual]
    after: list[Residual]
    floor: Array | None


@dataclass(frozen=True)
class HeldOut:
    """Errors on the held-out fold.

    Attributes:
        before, after: of the nominal model, and with the effects.
        noise_floor: None where no motion is repeated.
        closed: share of the gap above the floor that the effects close, at their joints and those
            at which structure is left.
        others_before, others_after: on each recording by fits to the others: what another motion
            may be expected to show. None for one recording.
    """

    before: Errors
    after: Errors
    noise_floor: Errors | None
    closed: float
    others_before: Errors | None = None
    others_after: Errors | None = None


@dataclass(frozen=True)
class Share:
    """Share of one joint and region in the gap.

    Attributes:
        joint: from 0.
        region: in words.
        share: of the whole squared gap, in units of the fit's noise.
    """

    joint: int
    region: str
    share: float


def before_and_after(found: SearchResult, before: Array, after: Array) -> BeforeAfter:
    """Residuals of both models on all rows.

    Args:
        found: the search.
        before: unknowns of the feasible nominal model, fitted on the searched folds.
        after: the same with the effects.
    """
    rows, repeats = found.rows, found.options.settings.repeats
    start, end = found.start.design(rows), found.end.design(rows)
    left = residuals(end, replace(found.end.fit, x=after))
    return BeforeAfter(
        end,
        residuals(start, replace(found.start.fit, x=before)),
        left,
        pure_error(found.source, rows, end, left, repeats),
    )


def held_out(found: SearchResult, both: BeforeAfter) -> HeldOut:
    """Errors on the held-out fold."""
    design = both.design
    kept = design.fold == HELD_OUT
    torque = found.rows.measured_torque
    before, after = (_errors(torque, side, kept) for side in (both.before, both.after))
    floor = None if both.floor is None else _floor(both, torque, kept)
    explained = [*found.verdict.effects, *found.verdict.transients]
    joints = {j for e in explained for j in e.joints}
    if explained:
        joints |= {n.structure.joint for n in found.verdict.unexplained}
    if floor is not None:
        floor = below_the_error(floor, after, found.options.settings.repeats.chance_ratio)
    believed = both if floor is not None else replace(both, floor=None)
    closed = _closed(found, believed, kept, sorted(joints))
    return HeldOut(before, after, floor, closed, *_other_recordings(found))


def below_the_error(floor: Errors, after: Errors, chance_ratio: float) -> Errors | None:
    """The noise floor, which cannot lie above the error of a fit.

    Where it does so by chance, the error is the floor. Where it does so clearly, what repeats is
    not the motion itself, and there is none.
    """
    if floor.relative_percent <= after.relative_percent:
        return floor
    by_chance = floor.relative_percent < chance_ratio * after.relative_percent
    return after if by_chance else None


def _other_recordings(found: SearchResult) -> tuple[Errors | None, Errors | None]:
    """Errors on each recording by fits to the others, without and with the effects.

    None for one recording. This is what may be expected of another motion.
    """
    count = int(found.rows.log.max()) + 1
    if count < 2:
        return None, None
    before, after = (_left_out(found, side, count) for side in (found.start, found.end))
    return before, after


def _left_out(found: SearchResult, side: CurrentFit, count: int) -> Errors:
    design = side.design(found.rows)
    log = found.rows.log
    used = design.fold != EXCLUDED
    apart = design.with_folds(np.where(used, log, EXCLUDED), count)
    structure = design.structure(side.model.shapes)
    whole = [np.array(r.values) for r in residuals(design, side.fit)]
    for k in range(count):
        rest = apart.equations.of([i for i in range(count) if i != k])
        predicted = residuals(design, fit(rest, structure, side.fit.sigma))
        for values, r in zip(whole, predicted, strict=True):
            if len(values):
                values[log == k] = r.values[log == k]
    left = [replace(r, values=v) for r, v in zip(residuals(design, side.fit), whole, strict=True)]
    return _errors(found.rows.measured_torque, left, used)


def _errors(torque: Array, side: Sequence[Residual], kept: NDArray[np.bool_]) -> Errors:
    """Errors beside measured torque of shape (R, n), from which no reference is subtracted."""
    squares = whole = 0.0
    rms = np.full(len(side), np.nan)
    for j, r in enumerate(side):
        if len(r.values):
            moving = kept & (r.region != Region.REVERSAL)
            values = r.values[moving]
            rms[j] = np.sqrt(np.mean(values**2)) if len(values) else np.nan
            squares += float(values @ values)
            whole += float((torque[moving, j] ** 2).sum())
    return Errors(100 * float(np.sqrt(squares / max(whole, 1e-300))), rms)


def _floor(both: BeforeAfter, torque: Array, kept: NDArray[np.bool_]) -> Errors:
    """Errors of a residual as large as the pure error of each row's region."""
    quiet = [
        replace(r, values=_noise(both, j)[r.region]) if len(r.values) else r
        for j, r in enumerate(both.after)
    ]
    return _errors(torque, quiet, kept)


def _noise(both: BeforeAfter, joint: int) -> Array:
    """Pure error of a joint by region; in regions without repeats the least of the others."""
    if both.floor is None:
        return np.zeros(len(Region))
    noise = both.floor[joint]
    known = np.isfinite(noise)
    return np.where(known, noise, noise[known].min() if known.any() else 0.0)


def _closed(
    found: SearchResult, both: BeforeAfter, kept: NDArray[np.bool_], joints: Sequence[int]
) -> float:
    """Share of the squared gap at some joints that is closed, in units of the fit's noise.

    Where structure is left, that noise holds it; the pure error does not.
    """
    unexplained = {n.structure.joint for n in found.verdict.unexplained}
    gap = rest = 0.0
    for j in joints:
        old, new = both.before[j], both.after[j]
        if len(new.values) == 0:
            continue
        noise = _noise(both, j)[new.region[kept]] ** 2
        left = found.end.fit.sigma[j][new.region[kept]] ** 2
        if j in unexplained:
            left = np.where(noise > 0.0, np.minimum(noise, left), left)
        weight = 1 / left
        gap += max(float(weight @ (old.values[kept] ** 2 - noise)), 0.0)
        rest += max(float(weight @ (new.values[kept] ** 2 - noise)), 0.0)
    return float(np.clip(1 - rest / gap, 0.0, 1.0)) if gap > 0.0 else 0.0


def gap_location(found: SearchResult, both: BeforeAfter) -> list[Share]:
    """Joints and regions of the gap, in units of the fit's noise there, the largest first.

    With accepted effects the gap is the part that they remove; else all above the pure error.
    """
    named = bool(found.verdict.effects or found.verdict.transients)
    sizes: list[tuple[int, Region, float]] = []
    if not named and not found.verdict.unexplained:
        return []
    unexplained = {n.structure.joint for n in found.verdict.unexplained}
    for j, (old, new) in enumerate(zip(both.before, both.after, strict=True)):
        if len(new.values) == 0 or (not named and j not in unexplained):
            continue
        noise = _noise(both, j) ** 2
        for region in Region:
            here = new.region == region
            reference = new.values[here] ** 2 if named else noise[region]
            size = float((old.values[here] ** 2 - reference).sum())
            loudness = size / found.end.fit.sigma[j, region] ** 2
            sizes.append((j, region, max(loudness, 0.0)))
    total = sum(size for _, _, size in sizes)
    shares = [
        Share(j, _words(found, j, region), size / total)
        for j, region, size in sizes
        if total > 0.0 and size > _NEGLIGIBLE * total
    ]
    return sorted(shares, key=lambda s: -s.share)


def _words(found: SearchResult, joint: int, region: Region) -> str:
    slow = found.end.model.slow[joint]
    return {
        Region.REVERSAL: f"|qd| < {slow:.2g} rad/s",
        Region.SLIDING: f"|qd| > {slow:.2g} rad/s",
        Region.MOTOR_REVERSAL: f"|qd| > {slow:.2g} rad/s, while a shared motor turns round",
    }[region]
