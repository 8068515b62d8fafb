"""Verdict, thresholds, pure error and lack of fit, each alone."""

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.candidate import Candidate, Coefficient, NoParameters, Value
from ident.effects.catalogue import catalogue
from ident.effects.events import CONTACT
from ident.gap.data.broken_time import Fault
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.remaining_structure import RemainingStructure, held_out_mismatch
from ident.gap.nulls.null_arms import phase_randomised
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.residuals import Residual
from ident.gap.regression.weighted_fit import Fit
from ident.gap.results.unexplained import (
    UnexplainedStructure,
    excess_over_pure_error,
    largest_by_joint,
    unclosed_fraction,
)
from ident.gap.results.verdict import Kind, decide
from ident.gap.selection.scoring import Score
from ident.gap.selection.state import AcceptedEffect
from ident.gap.selection.thresholds import least_threshold
from ident.gap.settings import GapSettings
from ident.gap.transients.detect import Transient

SETTINGS = GapSettings()


def score_of(effect: str) -> Score:
    hypothesis = Candidate(effect, (1,), (1,), (Coefficient("size", "N m"),), NoParameters())
    ones = np.ones((2, 1))
    fit = Fit(ModelStructure(np.zeros((2, 1))), np.ones(1), ones, ones.astype(int), np.eye(1))
    return Score(0, hypothesis, fit, 0.5, 0.5)


def found(effect: str = "stribeck", rivals: tuple[Score, ...] = (), explained: float = 3.0):
    removed = np.array([0.0, explained])
    return AcceptedEffect(score_of(effect), (1,), removed, (0.4,), rivals)


PUSH = Transient(
    0, 3.0, 4.0, (1,), np.array([2.0]), np.array([0.1]), 0.2, np.zeros(4, dtype=bool), np.ones(4)
)
FAULT = Fault("log: 9 times a sample is lost.", 9)
LARGE = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 0.4, 0.5), 0.6)
CLEAR = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 2.5, 0.99), 0.1)
CLEAR_BUT_TINY = UnexplainedStructure(
    RemainingStructure(1, "the position of joint 2", 2.5, 0.99), 0.02
)
AHEAD = UnexplainedStructure(
    RemainingStructure(1, "which part of the recordings it is", 2.5, 0.99, held_out_only=True), 0.1
)
MUCH_AHEAD = replace(AHEAD, share_of_gap=0.3)
SMALL = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 0.2, 0.3), 0.1)


@pytest.mark.parametrize(
    ("faults", "effects", "transients", "left", "kind"),
    [
        ([], [], [], [], Kind.NO_GAP),
        ([], [found()], [], [], Kind.NAMED),
        ([], [], [PUSH], [], Kind.NAMED),
        ([], [found()], [], [SMALL], Kind.NAMED),
        ([], [found(rivals=(score_of("nonlinear_viscous"),))], [], [], Kind.AMBIGUOUS),
        ([], [found()], [], [LARGE], Kind.UNKNOWN),
        ([], [], [], [LARGE], Kind.UNKNOWN),
        ([], [found()], [], [CLEAR], Kind.UNKNOWN),
        ([], [found()], [], [CLEAR_BUT_TINY], Kind.NAMED),
        ([], [found()], [], [AHEAD], Kind.NAMED),
        ([], [found()], [], [MUCH_AHEAD], Kind.UNKNOWN),
        ([FAULT], [found()], [PUSH], [LARGE], Kind.DATA_FAULT),
    ],
)
def test_verdict(faults, effects, transients, left, kind):
    assert decide(faults, effects, transients, left, SETTINGS).kind == kind


def test_an_effect_that_leaves_most_of_its_joints_gap_is_not_the_effect():
    assert decide([], [found()], [], [], SETTINGS, unclosed=0.3).kind == Kind.UNKNOWN
    assert decide([], [found()], [], [], SETTINGS, unclosed=0.05).kind == Kind.NAMED


def residual_of(sigma: float) -> CurrentFit:
    """A present model whose second joint leaves so much while it slides; the first leaves 1."""
    sizes = np.full((2, len(Region)), 1.0)
    sizes[1, Region.SLIDING] = sigma
    counts = np.ones((2, len(Region)), dtype=int)
    left = Fit(ModelStructure(np.zeros((2, 1))), np.ones(1), sizes, counts, np.eye(1))
    return CurrentFit(None, (), left)


def test_a_residual_far_above_the_pure_error_is_a_gap():
    noise = np.array([1.0, 1.0])
    (only,) = excess_over_pure_error(noise, residual_of(5.0), [], SETTINGS.repeats)
    assert only.structure.joint == 1
    assert only.structure.share == pytest.approx(1 - 1 / 25)
    assert decide([], [], [], [only], SETTINGS).kind == Kind.UNKNOWN
    assert excess_over_pure_error(noise, residual_of(5.0), [only], SETTINGS.repeats) == ()
    assert excess_over_pure_error(noise, residual_of(2.0), [], SETTINGS.repeats) == ()
    assert (
        excess_over_pure_error(np.array([1.0, np.nan]), residual_of(5.0), [], SETTINGS.repeats)
        == ()
    )
    assert excess_over_pure_error(None, residual_of(5.0), [], SETTINGS.repeats) == ()


def test_what_begins_with_the_recording_is_no_contact():
    early = replace(PUSH, start_s=0.35, at_start=True)
    verdict = decide([], [], [early], [], SETTINGS)
    assert (verdict.transients, verdict.unsure_transients) == ((), (early,))
    assert decide([], [], [replace(early, gain=0.4)], [], SETTINGS).kind == Kind.UNKNOWN


def test_a_contact_that_is_not_sure_is_not_named():
    unsure = replace(PUSH, sd=np.array([1.0]))
    verdict = decide([], [], [unsure, PUSH], [], SETTINGS)
    assert verdict.transients == (PUSH,)
    assert verdict.unsure_transients == (unsure,)
    assert decide([], [], [unsure], [], SETTINGS).kind == Kind.NO_GAP
    assert decide([], [], [replace(unsure, gain=0.4)], [], SETTINGS).kind == Kind.UNKNOWN


def test_the_unclosed_share_is_measured_from_the_pure_error():
    noise, before = np.array([1.0, 1.0]), residual_of(5.0)
    assert unclosed_fraction(
        noise, before, residual_of(3.0), [found()], SETTINGS.repeats
    ) == pytest.approx(8 / 24)
    assert unclosed_fraction(noise, before, residual_of(1.2), [found()], SETTINGS.repeats) == 0.0
    assert unclosed_fraction(None, before, residual_of(3.0), [found()], SETTINGS.repeats) == 0.0
    assert unclosed_fraction(noise, before, residual_of(3.0), [], SETTINGS.repeats) == 0.0


def test_phase_randomised_noise_is_drawn_from_sliding_rows():
    values = np.where(np.arange(400) % 2 == 0, 1.0, 50.0)
    region = np.where(np.arange(400) % 2 == 0, Region.SLIDING, Region.MOTOR_REVERSAL)
    none = np.zeros(400, dtype=bool)
    drawn = phase_randomised(
        Residual(values, region, np.zeros(400, dtype=int), none), np.random.default_rng(0)
    )
    assert np.abs(drawn).max() < 2.0


def test_structure_is_measured_against_what_the_effects_explained():
    threshold = least_threshold(SETTINGS.thresholds)
    left = [
        RemainingStructure(1, "the position of joint 2", 0.9, 0.5),
        RemainingStructure(1, "time, periodically", 0.5, 0.4),
        RemainingStructure(0, "the position of joint 1", 0.5 * threshold.structure, 0.4),
    ]
    (only,) = largest_by_joint(
        left, [found(explained=3.0)], np.array([1.0, 2.0]), threshold.structure
    )
    assert only.structure is left[0]
    assert only.share_of_gap == pytest.approx(1.0 / (1.0 + 3.0))


def test_recordings_disagree_where_the_model_fails_in_more_than_a_moment():
    fold = np.repeat([0, 1, 2], 100)
    rng = np.random.default_rng(3)
    calm = rng.normal(size=300)
    sliding, none = np.full(300, Region.SLIDING), np.zeros(300, dtype=bool)

    def left(last: np.ndarray) -> Residual:
        values = calm.copy()
        values[300 - len(last) :] = last
        return Residual(values, sliding, np.zeros(300, dtype=int), none)

    least = np.full(4, 1e-6)
    slips, louder = left(np.full(4, 40.0)), left(4 * rng.normal(size=100))
    fails = left(4 * np.sqrt(2) * np.sin(np.arange(100) / 8))
    (only,) = held_out_mismatch(
        [left(np.zeros(0)), slips, louder, fails], fold, least, SETTINGS.lack_of_fit
    )
    assert only.joint == 3
    assert only.share == pytest.approx(1 - np.exp(-2 * only.gain))
    assert only.gain == pytest.approx(np.log(4), abs=0.25)
    assert held_out_mismatch([fails], fold, np.array([10.0]), SETTINGS.lack_of_fit) == []


def test_thresholds_are_twice_the_gains_of_effect_free_runs_and_never_fall():
    first = least_threshold(SETTINGS.thresholds)
    assert set(first.gain) == {*catalogue(), CONTACT.id}
    second = first.raised(
        [{"stribeck": 0.2, "payload": 0.001}, {"stribeck": 0.1}], [0.05, 0.0], 2.0
    )
    assert second.of("stribeck") == pytest.approx(0.4)
    assert second.of("payload") == first.of("payload")
    assert (second.structure, second.draws) == (pytest.approx(0.1), 2)
    assert second.raised([{"stribeck": 0.0}], [0.0], 2.0).of("stribeck") == pytest.approx(0.4)


def test_a_drive_that_gives_less_is_reported_as_what_it_gives():
    fitted = {"error": Value(0.25, 0.01, "1")}  # the command is a quarter above the model
    told = catalogue()["torque_gain"].as_reported(score_of("torque_gain").candidate, fitted)
    assert told["error"].value == pytest.approx(0.8 - 1.0)
    assert told["error"].sd == pytest.approx(0.01 * 0.8**2)
