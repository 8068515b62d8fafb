"""Parts of the search that stand alone: windows, regions, thresholds, verdicts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ident.effects.candidate import Candidate, Coefficient, NoParameters, Value
from ident.effects.catalogue import catalogue
from ident.effects.events import CONTACT
from ident.effects.reversal_friction import SLOW, reversal_speed
from ident.gap.data.data_checks import Fault
from ident.gap.data.experiment import facts_of
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import Windows, windows_for
from ident.gap.lack_of_fit.remaining_structure import RemainingStructure, elsewhere
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.residuals import Residual
from ident.gap.regression.scoring import Score
from ident.gap.regression.weighted_fit import Fit, ModelStructure
from ident.gap.results.unclosed_gap import remaining, unnamed
from ident.gap.results.verdict import Kind, UnexplainedStructure, decide, unexplained_structures
from ident.gap.selection.acceptance import AcceptedEffect
from ident.gap.selection.null_arms import least_threshold, phase_randomised, raised
from ident.gap.transients.detect import Transient, at_end_stop
from ident.gap.transients.exclude import in_presliding_transient, still_significant


def score_of(effect: str) -> Score:
    hypothesis = Candidate(effect, (1,), (1,), (Coefficient("size", "N m"),), NoParameters())
    ones = np.ones((2, 1))
    fit = Fit(ModelStructure(np.zeros((2, 1))), np.ones(1), ones, ones.astype(int), np.eye(1))
    return Score(0, hypothesis, fit, 0.5)


def found(effect: str = "stribeck", rivals: tuple[Score, ...] = (), explained: float = 3.0):
    gains = np.array([0.0, 0.5])
    removed = np.array([0.0, explained])
    return AcceptedEffect(score_of(effect), (1,), gains, removed, (0.4,), rivals, None, np.inf)


BURST = Transient(0, 3.0, 4.0, (1,), np.array([2.0]), 0.3, np.zeros(4, dtype=bool), np.ones(4))
FAULT = Fault("dropped_samples", (), "log: 9 samples repeat.", 9.0)
LARGE = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 0.4, 0.5), 0.6)
CLEAR = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 2.5, 0.99), 0.1)
CLEAR_BUT_TINY = UnexplainedStructure(
    RemainingStructure(1, "the position of joint 2", 2.5, 0.99), 0.02
)
AHEAD = UnexplainedStructure(
    RemainingStructure(1, "which part of the recordings it is", 2.5, 0.99, ahead=True), 0.1
)
MUCH_AHEAD = replace(AHEAD, unexplained=0.3)
SMALL = UnexplainedStructure(RemainingStructure(1, "the position of joint 2", 0.2, 0.3), 0.1)


@pytest.mark.parametrize(
    ("faults", "effects", "transients", "left", "kind"),
    [
        ([], [], [], [], Kind.NO_GAP),
        ([], [found()], [], [], Kind.NAMED),
        ([], [], [BURST], [], Kind.NAMED),
        ([], [found()], [], [SMALL], Kind.NAMED),
        ([], [found(rivals=(score_of("nonlinear_viscous"),))], [], [], Kind.AMBIGUOUS),
        ([], [found()], [], [LARGE], Kind.UNKNOWN),
        ([], [], [], [LARGE], Kind.UNKNOWN),
        ([], [found()], [], [CLEAR], Kind.UNKNOWN),
        ([], [found()], [], [CLEAR_BUT_TINY], Kind.NAMED),
        ([], [found()], [], [AHEAD], Kind.NAMED),
        ([], [found()], [], [MUCH_AHEAD], Kind.UNKNOWN),
        ([FAULT], [found()], [BURST], [LARGE], Kind.DATA_FAULT),
    ],
)
def test_verdict(faults, effects, transients, left, kind):
    assert decide(faults, effects, transients, left).kind == kind


def test_an_effect_that_leaves_most_of_its_joints_gap_is_not_the_effect():
    assert decide([], [found()], [], [], remaining=0.3).kind == Kind.UNKNOWN
    assert decide([], [found()], [], [], remaining=0.05).kind == Kind.NAMED


def residual_of(sigma: float) -> CurrentFit:
    """A present model whose second joint leaves so much while it slides; the first leaves 1."""
    sizes = np.full((2, len(Region)), 1.0)
    sizes[1, Region.SLIDING] = sigma
    counts = np.ones((2, len(Region)), dtype=int)
    left = Fit(ModelStructure(np.zeros((2, 1))), np.ones(1), sizes, counts, np.eye(1))
    return CurrentFit(None, (), left)


def test_what_is_left_above_the_noise_of_repeats_is_a_gap():
    noise = np.array([1.0, 1.0])
    (only,) = unnamed(noise, residual_of(5.0), [])
    assert only.leftover.joint == 1
    assert only.leftover.share == pytest.approx(1 - 1 / 25)
    assert decide([], [], [], [only]).kind == Kind.UNKNOWN
    assert unnamed(noise, residual_of(5.0), [only]) == ()
    assert unnamed(noise, residual_of(2.0), []) == ()
    assert unnamed(np.array([1.0, np.nan]), residual_of(5.0), []) == ()
    assert unnamed(None, residual_of(5.0), []) == ()


def test_what_effects_leave_is_measured_from_the_noise_up():
    noise, before = np.array([1.0, 1.0]), residual_of(5.0)
    assert remaining(noise, before, residual_of(3.0), [found()]) == pytest.approx(8 / 24)
    assert remaining(noise, before, residual_of(1.2), [found()]) == 0.0
    assert remaining(None, before, residual_of(3.0), [found()]) == 0.0
    assert remaining(noise, before, residual_of(3.0), []) == 0.0


def test_noise_is_drawn_from_rows_in_which_nothing_turns_round():
    values = np.where(np.arange(400) % 2 == 0, 1.0, 50.0)
    region = np.where(np.arange(400) % 2 == 0, Region.SLIDING, Region.MOTOR_REVERSAL)
    none = np.zeros(400, dtype=bool)
    drawn = phase_randomised(
        Residual(values, region, np.zeros(400, dtype=int), none), np.random.default_rng(0)
    )
    assert np.abs(drawn).max() < 2.0


def test_what_comes_again_with_the_motion_is_no_contact():
    rows = np.array([False, True, False, False, False, False])
    repeats = np.array([0, 1, 2]), np.array([3, 4, 5])
    once = Transient(0, 3.0, 4.0, (1,), np.array([2.0]), 0.3, rows, np.array([1, 50.0, 1, 1, 1, 1]))
    again = replace(once, loudness=np.array([1, 50.0, 1, 1, 40.0, 1]))
    assert not once.repeats_with_motion(repeats)
    assert again.repeats_with_motion(repeats)
    assert not again.repeats_with_motion((repeats[0][:1], repeats[1][:1]))


def test_structure_is_measured_against_what_the_effects_explained():
    threshold = least_threshold()
    left = [
        RemainingStructure(1, "the position of joint 2", 0.9, 0.5),
        RemainingStructure(1, "time, periodically", 0.5, 0.4),
        RemainingStructure(0, "the position of joint 1", 0.5 * threshold.leftover, 0.4),
    ]
    (only,) = unexplained_structures(left, [found(explained=3.0)], np.array([1.0, 2.0]), threshold)
    assert only.leftover is left[0]
    assert only.unexplained == pytest.approx(1.0 / (1.0 + 3.0))


def test_a_bristle_that_has_hardly_stretched_is_no_contact():
    t = np.arange(0.0, 6.0, 0.01)
    q = np.column_stack([0.1 * t, np.zeros_like(t)])
    rows = SimpleNamespace(segments=(SimpleNamespace(log=0, t=t, q=q),))
    effect = catalogue()["presliding"]
    bristle = effect.at((0,), effect.Parameters(0.01), "dahl")
    now, none = SimpleNamespace(accepted=(bristle,)), SimpleNamespace(accepted=())
    early = replace(BURST, joints=(0,), start_s=0.2, end_s=0.8)
    assert in_presliding_transient(rows, now, early)
    assert not in_presliding_transient(rows, now, replace(early, end_s=1.5))
    assert not in_presliding_transient(rows, now, replace(early, joints=(1,)))
    assert not in_presliding_transient(rows, now, replace(early, log=1))
    assert not in_presliding_transient(rows, none, early)


def test_what_fails_everywhere_is_no_row_of_contacts():
    way = SimpleNamespace(rows=SimpleNamespace(apart=BURST.rows), transients=12 * [BURST])
    assert not still_significant(way)
    most = SimpleNamespace(apart=np.ones(4, dtype=bool))
    assert not still_significant(SimpleNamespace(rows=most, transients=[BURST]))


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
    (only,) = elsewhere([left(np.zeros(0)), slips, louder, fails], fold, least)
    assert only.joint == 3
    assert only.share == pytest.approx(1 - np.exp(-2 * only.gain))
    assert only.gain == pytest.approx(np.log(4), abs=0.25)
    assert elsewhere([fails], fold, np.array([10.0])) == []


def test_thresholds_are_twice_what_nothing_reaches_and_never_fall():
    first = least_threshold()
    assert set(first.gain) == {*catalogue(), CONTACT.id}
    second = raised(first, [{"stribeck": 0.2, "payload": 0.001}, {"stribeck": 0.1}], [0.05, 0.0])
    assert second.of("stribeck") == pytest.approx(0.4)
    assert second.of("payload") == first.of("payload")
    assert (second.leftover, second.draws) == (pytest.approx(0.1), 2)
    assert raised(second, [{"stribeck": 0.0}], [0.0]).of("stribeck") == pytest.approx(0.4)


def test_a_drive_that_gives_less_is_reported_as_what_it_gives():
    fitted = {"error": Value(0.25, 0.01, "1")}  # the command is a quarter above the model
    told = catalogue()["torque_gain"].as_reported(score_of("torque_gain").hypothesis, fitted)
    assert told["error"].value == pytest.approx(0.8 - 1.0)
    assert told["error"].sd == pytest.approx(0.01 * 0.8**2)


def test_windows_are_weighted_means_that_overlap_by_half():
    windows = windows_for(500.0, 10.0)
    assert (windows.hop, windows.cutoff_hz) == (25, 10.0)
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(260, 2))
    rows = windows.mean(samples)
    weight = np.sin(np.pi * (np.arange(50) + 0.5) / 50) ** 2
    expected = [weight @ samples[25 * k : 25 * k + 50] / weight.sum() for k in range(9)]
    assert rows == pytest.approx(np.array(expected), abs=1e-12)
    assert windows.least(samples) == pytest.approx(
        np.array([samples[25 * k : 25 * k + 50].min(axis=0) for k in range(9)])
    )
    t = np.arange(260) / 500.0
    assert windows.centres(t) == pytest.approx(25 * np.arange(1, 10) / 500.0)


def test_a_window_with_half_the_cutoff_keeps_half_a_sine():
    windows = Windows(25, 500.0)
    t = np.arange(5000) / 500.0
    rows = windows.mean(np.exp(2j * np.pi * windows.cutoff_hz * t).real[:, None])
    assert np.abs(rows).max() == pytest.approx(0.5, abs=0.02)


def test_regions_tell_turning_sliding_and_turning_of_a_shared_motor():
    windows = Windows(10, 500.0)
    speed = np.column_stack(
        [np.repeat([1.0, 0.0, 1.0, 1.0, 1.0], 10), np.repeat([0.5, 0.5, 1.0, -1.0, 0.5], 10)]
    )
    differential = np.array([[1.0, 1.0], [1.0, -1.0]])
    slow = np.array([0.02, 0.02])
    alone = regions(speed, slow, None, windows)
    assert alone[:, 0].tolist() == [
        Region.REVERSAL,
        Region.REVERSAL,
        Region.SLIDING,
        Region.SLIDING,
    ]
    assert (alone[:, 1] == Region.SLIDING).all()
    shared = regions(speed, slow, differential, windows)
    # the motors turn with q1 + q2 and q1 - q2: each stands still where the speeds are as large
    assert shared[:, 1].tolist() == [
        Region.SLIDING,
        Region.MOTOR_REVERSAL,
        Region.MOTOR_REVERSAL,
        Region.MOTOR_REVERSAL,
    ]
    assert shared[0, 0] == Region.REVERSAL


def test_wide_friction_curves_have_a_wide_slow_region():
    assert reversal_speed(1e-4) == SLOW[0]
    assert reversal_speed(0.02) == pytest.approx(0.03)
    assert reversal_speed(1.0) == SLOW[1]


def test_every_form_of_an_effect_is_tried(source):
    """At once, by a candidate of its own, or late, once the effect leads."""
    for effect in catalogue().values():
        found = effect.candidates(facts_of(source))
        for setting in (s for s in effect.nonlinear if s.discrete and not s.refine_only):
            begun = {h.numbers[setting.name] for h in found if setting.name in h.numbers}
            assert begun == set(setting.grid) or not begun


def test_contacts_wherever_a_joint_comes_so_far_may_be_a_stop():
    t = np.arange(0.0, 20.0, 0.01)
    swing = np.pi * t / 4
    q = np.column_stack([np.cos(0.7 * t), np.sin(swing)])
    qd = np.column_stack([-0.7 * np.sin(0.7 * t), np.pi / 4 * np.cos(swing)])
    rows = SimpleNamespace(segments=(SimpleNamespace(log=0, t=t, q=q, qd=qd),))
    tops = [replace(BURST, start_s=at - 0.5, end_s=at + 0.5) for at in (2.0, 10.0, 18.0)]
    assert at_end_stop(rows, tops) == (1,)
    assert at_end_stop(rows, tops[1:]) == ()
    assert at_end_stop(rows, tops[:1]) == ()
    assert at_end_stop(rows, [replace(b, joints=(0,)) for b in tops]) == ()
    elsewhere = [replace(b, start_s=b.start_s + 1.0, end_s=b.end_s + 1.0) for b in tops]
    assert at_end_stop(rows, elsewhere) == ()
    leaning = SimpleNamespace(log=1, t=t, q=np.ones_like(q), qd=np.zeros_like(q))
    assert at_end_stop(SimpleNamespace(segments=(*rows.segments, leaning)), tops) == (1,)
