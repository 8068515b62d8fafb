"""What comes again with the motion: the residual beside the noise from one period to the next.

Where a joint slides, and nothing is missing, the two are the same; what is systematic is larger.
Known only where a motion is repeated.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.gap.data.experiment import Experiment
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.remaining_structure import OF_TRUSTED, RemainingStructure
from ident.gap.lack_of_fit.repeatability import noise_floor
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.design_matrix import WindowedRows, build_design_matrix
from ident.gap.regression.residuals import residuals
from ident.gap.results.verdict import UnexplainedStructure
from ident.gap.selection.acceptance import AcceptedEffect

Array = NDArray[np.floating]

_CLEARLY = 1.3  # times the noise: less is chance (0.9 to 1.2 on effect-free arms)
_STRUCTURE = 3.0  # times the noise: a gap, even if no curve follows it; less may be the arm model


def noise_of(source: Experiment, rows: WindowedRows, present: CurrentFit) -> Array | None:
    """Rms noise of each joint while it slides [N m], shape (n,); None without repeats.

    Not-a-number for joints of which no repeat tells. What a trusted model gets wrong counts as
    noise too: it comes again, but nothing has changed.
    """
    table = build_design_matrix(rows, present.model, present.accepted)
    floor = noise_floor(source, rows, table, residuals(table, present.fit))
    if floor is None:
        return None
    quiet = floor[:, Region.SLIDING]
    return quiet if rows.least is None else np.fmax(quiet, OF_TRUSTED * rows.least)


def remaining(
    noise: Array | None, start: CurrentFit, end: CurrentFit, found: Sequence[AcceptedEffect]
) -> float:
    """Part of the squared gap above the noise that is left at the effects' joints.

    Zero where no motion is repeated, or where what is left may be chance.
    """
    seats = sorted({j for f in found for j in f.seat})
    if noise is None or not seats:
        return 0.0
    quiet = np.nan_to_num(noise[seats])
    before, after = (p.fit.sigma[seats, Region.SLIDING] for p in (start, end))
    if not (after > _CLEARLY * quiet).any():
        return 0.0
    gap = float(np.maximum(before**2 - quiet**2, 0.0) @ (1 / after**2))
    left = float(np.maximum(after**2 - quiet**2, 0.0) @ (1 / after**2))
    return left / gap if gap > 0.0 else 0.0


def unnamed(
    noise: Array | None, end: CurrentFit, noted: Sequence[UnexplainedStructure]
) -> tuple[UnexplainedStructure, ...]:
    """Joints whose residual is clearly more than noise, beside those that are noted already."""
    if noise is None:
        return ()
    ratio = end.fit.sigma[:, Region.SLIDING] / np.where(noise > 0.0, noise, np.inf)
    told = {n.leftover.joint for n in noted}
    there = [int(j) for j in np.flatnonzero(ratio > _STRUCTURE) if j not in told]
    name = "the motion, in the same way each time it is repeated"
    return tuple(
        UnexplainedStructure(
            RemainingStructure(j, name, float(np.log(ratio[j])), float(1 - ratio[j] ** -2)), 1.0
        )
        for j in sorted(there, key=lambda j: -ratio[j])
    )
