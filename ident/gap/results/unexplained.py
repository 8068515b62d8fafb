"""What the accepted effects leave: unexplained structure, and the part of the gap not closed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.remaining_structure import (
    RemainingStructure,
    remaining_structures,
    share_of,
)
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import mean_squares
from ident.gap.selection.scoring import main_joints
from ident.gap.selection.state import AcceptedEffect, SelectionState
from ident.gap.settings import GapSettings, Repeats, Transients
from ident.gap.transients.detect import Transient, at_end_stop
from ident.signals.arrays import Array


@dataclass(frozen=True)
class UnexplainedStructure:
    """Structure on a joint that no effect explains.

    Attributes:
        structure: what it depends on, and how much it is.
        share_of_gap: its share of the joint's whole gap.
    """

    structure: RemainingStructure
    share_of_gap: float


def unexplained_structures(
    state: SelectionState, settings: GapSettings
) -> tuple[UnexplainedStructure, ...]:
    """Structure that counts, one entry a joint, the largest first."""
    left = remaining_structures(state.rows, state.current, settings.lack_of_fit)
    return largest_by_joint(
        left, state.accepted, mean_squares(state.current.fit), state.threshold.structure
    )


def largest_by_joint(
    left: Sequence[RemainingStructure],
    accepted: Sequence[AcceptedEffect],
    squares: Array,
    least: float,
) -> tuple[UnexplainedStructure, ...]:
    """The largest structure of each joint, beside what the effects explained there.

    Args:
        left: structures by gain, the largest first.
        accepted: effects.
        squares: mean squared residual of each joint with them [N^2 m^2], shape (n,).
        least: gain from which structure counts [nats per sample].
    """
    kept: dict[int, UnexplainedStructure] = {}
    for structure in left:
        j = structure.joint
        if j not in kept and structure.gain >= least:
            explained = sum(float(a.explained[j]) for a in accepted)
            rest = structure.share * float(squares[j])
            kept[j] = UnexplainedStructure(structure, rest / max(rest + explained, 1e-300))
    return tuple(kept.values())


def inconsistent_effect(
    state: SelectionState, settings: GapSettings
) -> tuple[UnexplainedStructure, ...]:
    """The best candidate, if it explains much on the whole but not on every part of the data."""
    best = state.scores[-1][0] if state.scores[-1] else None
    if best is None:
        return ()
    if best.gain < max(settings.lack_of_fit.clear_gain, state.threshold.of(best.candidate.effect)):
        return ()
    name = "what is not the same in all parts of the recordings"
    joints = main_joints(best, state.current.fit, settings.scoring)
    return _whole_gap([(j, best.gain) for j in joints], name)


def end_stops(
    rows: WindowedRows, transients: Sequence[Transient], settings: Transients
) -> tuple[UnexplainedStructure, ...]:
    """Joints whose transients look like an end stop, which the catalogue does not have."""
    gain = max((b.gain for b in transients), default=0.0)
    found = []
    for j in at_end_stop(rows, transients, settings):
        found += _whole_gap([(j, gain)], f"the position of joint {j + 1}")
    return tuple(found)


def excess_over_pure_error(
    noise: Array | None,
    end: CurrentFit,
    noted: Sequence[UnexplainedStructure],
    settings: Repeats,
) -> tuple[UnexplainedStructure, ...]:
    """Joints whose residual is far above the pure error, but for those already noted."""
    if noise is None:
        return ()
    ratio = end.fit.sigma[:, Region.SLIDING] / np.where(noise > 0.0, noise, np.inf)
    known = {n.structure.joint for n in noted}
    there = [int(j) for j in np.flatnonzero(ratio > settings.structure_ratio) if j not in known]
    name = "the motion, in the same way each time it is repeated"
    order = sorted(there, key=lambda j: -ratio[j])
    return _whole_gap([(j, float(np.log(ratio[j]))) for j in order], name)


def _whole_gap(gains: Sequence[tuple[int, float]], name: str) -> tuple[UnexplainedStructure, ...]:
    """Structure that is all of its joint's gap."""
    return tuple(
        UnexplainedStructure(RemainingStructure(j, name, gain, share_of(gain)), 1.0)
        for j, gain in gains
    )


def unclosed_fraction(
    noise: Array | None,
    start: CurrentFit,
    end: CurrentFit,
    accepted: Sequence[AcceptedEffect],
    settings: Repeats,
) -> float:
    """Share of the squared gap above the pure error that is left at the effects' joints.

    Zero where no motion is repeated, or where the rest may be chance.
    """
    joints = sorted({j for a in accepted for j in a.joints})
    if noise is None or not joints:
        return 0.0
    pure = np.nan_to_num(noise[joints])
    before, after = (p.fit.sigma[joints, Region.SLIDING] for p in (start, end))
    if not (after > settings.chance_ratio * pure).any():
        return 0.0
    gap = float(np.maximum(before**2 - pure**2, 0.0) @ (1 / after**2))
    left = float(np.maximum(after**2 - pure**2, 0.0) @ (1 / after**2))
    return left / gap if gap > 0.0 else 0.0
