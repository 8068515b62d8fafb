"""Pure error: how much the residual differs when the same motion is repeated.

A textbook test of lack of fit compares the residual with the scatter among replicates. Errors of
the model repeat with the motion and cancel in the difference of two periods; noise does not.
"""

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.experiment import Experiment
from ident.gap.data.noise_regions import Region
from ident.gap.data.rounding import RMS_OF_LARGEST, torque_resolution
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.residuals import Residual, residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.settings import LackOfFit, Repeats
from ident.model.attachments import attached_trajectory
from ident.signals.arrays import Array


def pure_error(
    source: Experiment,
    rows: WindowedRows,
    design: DesignMatrix,
    left: list[Residual],
    settings: Repeats,
) -> Array | None:
    """Rms noise per joint and region [N m], shape (n, regions), from one period to the next.

    None where no motion is repeated; not-a-number for regions without repeats and held joints.
    """
    first, second = repeated_rows(source, rows, settings)
    if len(first) < settings.min_rows:
        return None
    noise = np.full((len(left), len(Region)), np.nan)
    for j, r in enumerate(left):
        if len(r.values) == 0:
            continue
        for region in Region:
            here = (r.region[first] == region) & (r.region[second] == region)
            if here.sum() >= settings.min_rows:
                change = r.values[second[here]] - r.values[first[here]]
                noise[j, region] = np.sqrt(np.mean(change**2) / 2)
    return noise


def sliding_noise(
    source: Experiment,
    rows: WindowedRows,
    current: CurrentFit,
    repeats: Repeats,
    lack_of_fit: LackOfFit,
) -> Array | None:
    """Rms noise of each joint while it slides [N m], shape (n,); None without repeats.

    Not-a-number for joints without repeats. Rounding counts as noise where torque is recorded in
    steps, and so do errors of a reference model: they repeat, but nothing has changed.
    """
    design = current.design(rows)
    noise = pure_error(source, rows, design, residuals(design, current.fit), repeats)
    if noise is None:
        return None
    rounding = RMS_OF_LARGEST * torque_resolution(source)
    sliding = np.maximum(noise[:, Region.SLIDING], rounding)
    if rows.reference_error is None:
        return sliding
    return np.fmax(sliding, lack_of_fit.reference_error_factor * rows.reference_error)


def first_pass(source: Experiment, rows: WindowedRows, settings: Repeats) -> NDArray[np.int64]:
    """The row nearest to where the arm was in the same motion for the first time, shape (R,)."""
    first, second = repeated_rows(source, rows, settings)
    log, t = rows.log, rows.t
    before = np.arange(len(t))
    for number in range(len(source.recordings)):
        pairs = log[first] == number
        if pairs.sum() < settings.min_rows:
            continue
        here = np.flatnonzero(log == number)
        then = t[here] - np.median(t[second[pairs]] - t[first[pairs]])
        nearest = np.searchsorted(t[here] + rows.hop_s / 2, then).clip(max=len(here) - 1)
        known = np.abs(t[here][nearest] - then) < rows.hop_s
        before[here[known]] = here[nearest[known]]
    while (before[before] != before).any():
        before = before[before]
    return before


def repeated_rows(
    source: Experiment, rows: WindowedRows, settings: Repeats
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of one period, and the same rows of the next.

    The period is that of the trajectory attached to the log. Without one it is the lag after which
    the arm is back in the same place in the most rows.
    """
    log, t = rows.log, rows.t
    q = rows.blocks.means(lambda s: s.q)
    none = np.zeros(0, dtype=np.int64)
    first, second = [none], [none]
    for number, (recording, data) in enumerate(
        zip(source.recordings, source.datasets, strict=True)
    ):
        here = np.flatnonzero(log == number)
        hops = np.round(t[here] / rows.hop_s).astype(int)
        row = np.full(hops.max(initial=-1) + 1, -1)
        row[hops] = here
        file = attached_trajectory(recording, data.name)
        if file is None:
            lag = _period(q, row, settings)
        else:
            lag = round(2 * np.pi / file.fundamental_rad_s / rows.hop_s)
        if lag is not None:
            one, two = _rows_apart(row, lag)
            same = np.abs(q[two] - q[one]).max(axis=1, initial=0.0) < settings.same_place_rad
            first.append(one[same])
            second.append(two[same])
    return np.concatenate(first), np.concatenate(second)


def _period(q: Array, row: NDArray[np.int64], settings: Repeats) -> int | None:
    """Number of hops after which a recording's motion repeats; None if it does not.

    Args:
        q: position of each row [rad], shape (R, n).
        row: number of the row at each hop, -1 where there is none.
        settings: of repeats.
    """
    rows = int((row >= 0).sum())
    most, best, away = max(settings.min_rows, settings.min_row_share * rows), None, False
    for lag in range(1, len(row) - settings.min_rows):
        one, two = _rows_apart(row, lag)
        if len(one) == 0:
            continue
        distance = np.abs(q[two] - q[one]).max(axis=1)
        away = away or float(np.median(distance)) > settings.excursion * settings.same_place_rad
        close = int((distance < settings.same_place_rad).sum())
        if away and close > most:
            most, best = close, lag
    return best


def _rows_apart(row: NDArray[np.int64], lag: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows that lie so many hops apart."""
    one, two = row[:-lag], row[lag:]
    both = (one >= 0) & (two >= 0)
    return one[both], two[both]
