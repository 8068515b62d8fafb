"""Every number that decides a verdict of `ident gap`, with its unit and the reason for its value.

Grids that are searched and tolerances of pure numerics stay where they are used. The table in the
README of this folder is written from this file by `python -m ident.gap.settings`.
"""

from ident.model.setting_fields import Section as _Section
from ident.model.setting_fields import count as _count
from ident.model.setting_fields import positive as _positive
from ident.model.setting_fields import share as _share
from ident.model.setting_fields import table


class LongLogs(_Section):
    """Long logs are searched by stretches, so that memory does not grow with their length."""

    most_s: float = _positive(150.0, "Longest log that is searched whole [s]: 7 periods of 20 s.")
    stretch_s: float = _positive(40.0, "Length of a longer one's stretch [s]: two such periods.")
    count: int = _count(3, "Stretches of all logs together [1]: one for each fold.")


class BrokenTime(_Section):
    """Steps at which stamps and motion disagree, see `data/broken_time.py`."""

    usual_share: float = _share(
        0.99, "Quantile of the steps' distances from their neighbours' that is the usual one [1]."
    )
    far: float = _positive(12.0, "Times the usual distance from which a step is broken [1].")
    least_steps: float = _positive(
        0.5, "Steps by which all joints must be ahead or behind [1]: one where a sample is lost."
    )
    least_pause: float = _positive(
        0.1, "The same where joints beside the one that shows it most are as far from usual [1]."
    )
    apart: float = _share(0.3, "Part of a shift by which joints may disagree [1]: impacts do.")
    least_kept: float = _share(
        0.6, "Of a recording that must be left once the broken steps are cut out [1]."
    )


class Scoring(_Section):
    """Which effects are fitted, and how many are accepted."""

    max_cutoff_share: float = _share(
        0.2, "Largest cut-off of the windows [sampling rates]: faster motion is not resolved."
    )
    cost_per_coefficient: float = _positive(
        0.01, "Cost of each coefficient after the first in the ranking [nats per sample]."
    )
    min_shortlist_gain: float = _positive(
        0.005,
        "Approximate gain from which a candidate is fitted exactly [nats per sample]: an eighth of"
        " the smallest threshold, since the exact gain may be larger.",
    )
    main_joint_share: float = _share(
        0.2, "Share of the largest joint's gain that makes a joint one of the main joints [1]."
    )
    same_effect_share: float = _share(
        0.3,
        "Share of the leader's gain with which the same effect at another joint is accepted in the"
        " same round [1]. Smaller ones wait for the next round.",
    )
    retuned_gain_ratio: float = _positive(
        2.0,
        "A candidate that fails cross-validation is asked again if tuning multiplies its gain by"
        " this [1]: before, its settings were too far off for the folds to confirm it.",
    )
    refined_form_share: float = _share(
        0.8,
        "Share of its best form's gain with which another form of an effect is refined on [1].",
    )
    max_effects: int = _count(
        6, "Most different effects of one answer [1]; the search ends after twice as many rounds."
    )


class Thresholds(_Section):
    """Gain that an effect needs, from effect-free data of the same arm."""

    min_gain: float = _positive(
        0.04, "Least gain of an effect [nats per sample]: 4 % less rms residual at one joint."
    )
    min_gain_beside_reference: float = _positive(
        0.1,
        "The same beside a reference model [nats per sample]. Errors of that model do not show in"
        " effect-free simulations.",
    )
    min_transient_gain: float = _positive(
        0.15,
        "Least gain of a transient [nats per sample]: it is the best of hundreds of intervals.",
    )
    safety_factor: float = _positive(
        2.0,
        "Multiple of the largest gain in effect-free simulations, and of the least gain for"
        " structure without a name [1]. A handful of simulations do not show the extreme.",
    )
    chance_quantile: float = _share(
        0.99, "Quantile of the gains on phase-randomised residuals that an effect must exceed [1]."
    )


class EffectFreeData(_Section):
    """How the data look that are made without an effect, for the thresholds."""

    chance_draws: int = _count(100, "Phase-randomised residuals behind `chance_quantile` [1].")
    presliding_rad: float = _positive(
        5e-4,
        "Presliding distance of a quarter of joints that show none, 0.4 of it of another quarter,"
        " none of the rest [rad]: too short to be seen.",
    )
    tail_low: float = _positive(0.8, "Least exponent of a drawn sign of speed [1]: a long tail.")
    tail_high: float = _positive(3.0, "Greatest exponent of a drawn sign of speed [1]: a ramp.")
    dahl_low: float = _positive(0.4, "Least exponent of Dahl's equation (1968) [1]: brittle.")
    dahl_high: float = _positive(3.0, "Greatest exponent of Dahl's equation [1]: very ductile.")
    curve_draws: int = _count(
        8, "Curves that are drawn for a joint until one explains it [1]; then it keeps its own."
    )
    min_free_share: float = _share(0.1, "Least share of rows that is free to tell the noise [1].")


class CrossValidation(_Section):
    """Gain on data that the effect was not fitted to."""

    min_energy_share: float = _share(
        0.1, "Share of an effect's squared torque from which a fold counts as exciting it [1]."
    )
    min_gain_share: float = _share(
        0.25, "Share of its gain on each exciting fold to keep with the size of the others [1]."
    )
    min_confirmed_share: float = _share(
        0.1, "Share of its gain that it must keep on the held-out fold beside all others [1]."
    )


class Misspecification(_Section):
    """When a small effect may be the error of another effect's form."""

    small_share: float = _share(
        0.12, "Share of what the earlier effect explained, below which the doubt arises [1]."
    )
    min_kept_share: float = _share(
        0.5, "Share of its gain that the small effect must keep beside free curves [1]."
    )
    above_noise: float = _positive(
        2.0, "Residual in units of the pure error from which closing the gap clears it [1]."
    )
    max_left_share: float = _share(
        0.2, "Largest share of the squared gap above the pure error that is then left [1]."
    )


class Significance(_Section):
    """Standard errors that a coefficient must be away from zero."""

    z: float = _positive(
        2.5, "Standard errors of the defining coefficient [1]: 1.2 % of a normal distribution."
    )
    z_fixed_settings: float = _positive(
        8.0,
        "The same with the settings held [1]. Standard errors are too small then.",
    )
    min_consistent_share: float = _share(
        0.75,
        "Share of its gain that an effect must keep when a number that stands in its form and as"
        " its coefficient is made one [1]. With less, the effect is another one.",
    )
    block_s: float = _positive(
        1.5, "Blocks of time whose residuals count as independent [s]: longer than they correlate."
    )


class Rivals(_Section):
    """When two effects cannot be told apart."""

    log_likelihood: float = _positive(
        4.0, "Smaller differences of the log-likelihood make a rival [nats]: odds of 55 to 1."
    )
    gain_ratio: float = _share(
        0.93, "A rival reaches this share of the leader's gain, whatever the likelihood says [1]."
    )
    lookalike_gain: float = _positive(
        0.02,
        "Effects that the catalogue lists as alike are rivals below this difference [nats per"
        " sample]; of what shows mainly while the joint slides, there as well. The model of the"
        " reversals alone may cause as much.",
    )
    form_gain: float = _positive(
        0.05, "Forms of one effect within this difference widen its interval [nats per sample]."
    )
    near_form_gain: float = _positive(
        0.7,
        "The same of the interval that is reported [nats per sample]: a residual twice as large."
        " The true form need be none of them, and misfits this close do not tell which is nearest.",
    )
    constant_share: float = _share(
        0.75,
        "Share of its gain at which an effect that changes with time yields to one that does not"
        " [1]: without repeats, time and motion are hard to tell apart.",
    )
    tuned_share: float = _share(
        0.75, "Share of the leader's gain from which a rival's settings are tuned too [1]."
    )


class Transients(_Section):
    """Short intervals with excess residual power, and when they are excluded."""

    max_count: int = _count(12, "Most intervals that are excluded [1]. More are no events.")
    max_time_share: float = _share(0.2, "Largest share of the data that is excluded [1].")
    share_beside_effect: float = _share(
        0.25,
        "Share of the best effect's gain that an interval needs beside it [1]. Less may be the"
        " error of the effect's form where it acts most.",
    )
    repeat_share: float = _share(
        0.1, "An interval whose excess power comes back by this share with the motion is none [1]."
    )
    loudness: float = _positive(
        9.0, "Mean square in units of the noise from which a joint is affected [1]: three sigma."
    )
    friction_share: float = _share(
        0.01,
        "Least torque of an interval, as a share of the joint's Coulomb friction [1], as in names.",
    )
    end_margin: float = _share(
        0.01, "Share of its range by which a joint must go further than ever for an end stop [1]."
    )
    sliding_speed: float = _positive(
        0.05, "Slower joints may lean on a stop without showing it [rad/s]."
    )
    settled_bristles: float = _positive(
        10.0,
        "Presliding distances that forget the unknown initial state [1]: exp(-10).",
    )
    impact_ratio: float = _positive(
        4.0, "An impact-like effect acts in the interval if its mean square rises by this [1]."
    )
    min_impact_share: float = _share(
        0.1, "Its least mean square there in units of the residual's [1]: a third of its size."
    )
    push_share: float = _share(
        0.2,
        "Squared mean over mean square of a push [1]: half a sine has 0.8, ringing 0.",
    )
    merge_s: float = _positive(0.5, "Intervals closer than this are one event [s].")
    span_ratio: float = _positive(
        1.5, "An interval's samples may span this many times its length, if some are missing [1]."
    )


class LackOfFit(_Section):
    """Structure that no effect explains."""

    clear_gain: float = _positive(
        0.3,
        "Gain from which structure is clear [nats per sample], 45 % of the squares: without an"
        " accepted effect it always counts, beside one only very little is allowed.",
    )
    reference_error_factor: float = _positive(
        2.0, "Errors of a reference model on other motions in units of that on its own [1]."
    )
    disagreement: float = _positive(
        0.7, "Held-out residual over searched one from which recordings disagree [nats]: twice."
    )
    usual_quantile: float = _share(
        0.95,
        "Residuals beyond this quantile are clipped before [1]: short events do not count.",
    )
    memory_rows: int = _count(
        6, "Rows after which noise is forgotten but the motion is not [rows]: 0.3 s at 10 Hz."
    )


class Repeats(_Section):
    """Pure error from motion that is repeated."""

    same_place_rad: float = _positive(
        0.01, "Two rows are repeats when no joint is further apart than this [rad]."
    )
    min_rows: int = _count(20, "Fewest repeated rows from which noise is estimated [rows].")
    excursion: float = _positive(
        10.0, "Motion must leave a place by this many `same_place_rad` before it comes back [1]."
    )
    min_row_share: float = _share(
        0.1, "Smallest share of a recording's rows that must come back for it to be periodic [1]."
    )
    chance_ratio: float = _positive(
        1.3,
        "Residual over pure error that is chance [1]: 0.9 to 1.2 on effect-free arms.",
    )
    structure_ratio: float = _positive(
        3.0,
        "Residual over pure error that is a gap in any case [1]: effect-free arms reach 1.6.",
    )


class Naming(_Section):
    """What an effect in the final fit needs beside its gain to be named, not only suspected."""

    z: float = _positive(3.0, "Standard errors of its size beside all others [1]: 0.3 % by chance.")
    min_friction_share: float = _share(
        0.01,
        "Its largest torque, as a share of the joint's Coulomb friction [1]. Less is told by no"
        " model of friction for sure, unless next to nothing is left.",
    )
    min_residual_share: float = _share(
        0.25, "Rms torque that it explains, as a share of the residual [1]: enough instead."
    )
    leaning_share: float = _share(
        0.05, "Change of a value from which it leans on an effect without which it is fitted [1]."
    )
    possible_share: float = _share(0.1, "Change of size beside possible links that is none [1].")


class Verdict(_Section):
    """When names are not the whole answer."""

    max_unexplained: float = _share(
        0.2, "Largest share of a joint's gap that may be left beside the accepted effects [1]."
    )
    max_unexplained_clear: float = _share(
        0.03, "The same where the structure that is left is clear [1]: the form is another one."
    )
    max_unclosed: float = _share(
        0.12, "Largest share of the squared gap above the pure error that may be left [1]."
    )


class GapSettings(_Section):
    """All of them, by stage."""

    long_logs: LongLogs = LongLogs()
    broken_time: BrokenTime = BrokenTime()
    scoring: Scoring = Scoring()
    thresholds: Thresholds = Thresholds()
    effect_free_data: EffectFreeData = EffectFreeData()
    cross_validation: CrossValidation = CrossValidation()
    misspecification: Misspecification = Misspecification()
    significance: Significance = Significance()
    rivals: Rivals = Rivals()
    transients: Transients = Transients()
    lack_of_fit: LackOfFit = LackOfFit()
    repeats: Repeats = Repeats()
    naming: Naming = Naming()
    verdict: Verdict = Verdict()


if __name__ == "__main__":
    print(table(GapSettings()))  # noqa: T201
