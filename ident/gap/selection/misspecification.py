"""Misspecification: is a small effect only the error of an earlier effect's form?"""

import functools
from collections.abc import Sequence

import numpy as np

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.effect import FormUncertainty
from ident.gap.data.blocks import SEARCHED
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.basis_functions import FreeCurves, form_columns
from ident.gap.regression.design_matrix import DesignMatrix
from ident.gap.regression.projection import joint_rows, projected
from ident.gap.regression.residuals import residuals
from ident.gap.regression.weighted_fit import mean_squares
from ident.gap.selection.refinement import refine_nonlinear_parameters
from ident.gap.selection.scoring import Score, main_joints
from ident.gap.selection.state import SelectionState
from ident.gap.settings import GapSettings, Misspecification


def stands_beside_accepted(
    state: SelectionState,
    design: DesignMatrix,
    score: Score,
    settings: GapSettings,
    use_repeats: bool = True,
) -> bool:
    """Whether an effect explains more than the form of an accepted effect may get wrong.

    A small effect must keep its gain beside free curves for that form, or close nearly all of the
    gap above the pure error.

    Args:
        state: of the search.
        design: with the effect's columns.
        score: of the effect.
        settings: of the search.
        use_repeats: allow the last of these.
    """
    chosen = settings.misspecification
    joints = main_joints(score, state.current.fit, settings.scoring)
    suspects = _suspects(state, score, joints, chosen)
    if not suspects or significant_beside(state, design, score, suspects, chosen):
        return True
    return use_repeats and _closes_the_gap(state, score, joints, settings)


def _suspects(
    state: SelectionState, score: Score, joints: Sequence[int], settings: Misspecification
) -> list[tuple[Candidate, int]]:
    """Accepted effects, and joints, beside which an effect is so small that it is in doubt."""
    here = list(joints)
    drop = (mean_squares(state.current.fit) - mean_squares(score.fit))[here].sum()
    found = []
    for earlier in state.accepted:
        effect = earlier.candidate.effect
        certain = catalogue()[effect].form_uncertainty is FormUncertainty.NONE
        if certain or effect == score.candidate.effect:
            continue
        small = drop < settings.small_share * earlier.explained[here].sum()
        if small and set(earlier.joints) & set(here):
            found += [(earlier.candidate, j) for j in here if j in earlier.joints]
    return found


def significant_beside(
    state: SelectionState,
    design: DesignMatrix,
    score: Score,
    suspects: Sequence[tuple[Candidate, int]],
    settings: Misspecification,
) -> bool:
    """Whether an effect keeps most of its gain beside free curves for the forms of others.

    Args:
        state: of the search.
        design: with the effect's columns.
        score: of the effect.
        suspects: the other effects, and on which joints, from 0.
        settings: of the test.
    """
    return all(_kept(state, design, score, s) > settings.min_kept_share for s in suspects)


def _kept(
    state: SelectionState, design: DesignMatrix, score: Score, suspect: tuple[Candidate, int]
) -> float:
    """Share of an effect's gain on a joint that is left beside free curves; zero if none."""
    other, joint = suspect
    freedom, now = catalogue()[other.effect].form_uncertainty, state.current.fit
    if freedom is FormUncertainty.ANY or joint not in score.candidate.rows:
        return 0.0
    form = functools.partial(form_columns, joint=joint, freedom=freedom)
    curves = FreeCurves(state.rows, state.current.model).windowed(form)[0]
    own = design.effect_columns(score.index, joint)
    sliding = np.isin(design.fold, SEARCHED) & (design.region[:, joint] != Region.REVERSAL)
    left = residuals(design, now)[joint].values
    here = joint_rows(design, now, joint, sliding, left)
    whole = float(here.error @ here.error)
    rest = [
        max(1e-12 * whole, whole - 2 * projected(now, here, c).fitted(here.error).gain)
        for c in (np.zeros((len(own), 0)), own, curves, np.column_stack([curves, own]))
    ]
    alone, beside = np.log(rest[0] / rest[1]), np.log(rest[2] / rest[3])
    return float(beside / alone) if alone > 0.0 else 0.0


def _closes_the_gap(
    state: SelectionState, score: Score, joints: Sequence[int], settings: GapSettings
) -> bool:
    """Whether the refined effect closes nearly all of a gap that is clearly above the noise."""
    if state.noise is None:
        return False
    chosen, here = settings.misspecification, list(joints)
    noise = np.nan_to_num(state.noise[here])
    now = state.current.fit.sigma[here, Region.SLIDING]
    if not (now > chosen.above_noise * noise).any():
        return False
    refined = refine_nonlinear_parameters(state.rows, state.current, score, settings.scoring)[0]
    then = refined.fit.sigma[here, Region.SLIDING]
    return bool((then**2 - noise**2 < chosen.max_left_share * (now**2 - noise**2)).all())
