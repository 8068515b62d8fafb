"""How errors of simulated positions are compared: no few blocks of time decide."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from ident.output_error.first_guess import neutral
from ident.output_error.fit import Fit
from ident.output_error.identify import is_vague
from ident.output_error.judging import blocks, explained, gain, left_out, sureness, typical
from ident.output_error.missing.verdict import nearly_sure
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.search.parts import ENCODER_OFFSET, OFFSET, SERVO_PARTS, SPRING, Part
from ident.output_error.search.rounds import worth_a_fit
from ident.output_error.search.screening import promising
from ident.output_error.search.selection import Accepted, Selection
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial, felt, scanned
from ident.output_error.search.winners import winners
from ident.output_error.setup import MEMORY_S, MotionSegment, Prior, Setup
from ident.output_error.uncertainty import Knowledge

LOW = SearchSettings(least_gain=0.01)
LEAST = SearchSettings(least_gain=0.02)

PROFILE, LIMIT, SPEED = (
    next(p for p in SERVO_PARTS if p.name == name)
    for name in ("profile", "torque_limit", "profile_speed")
)
GEARS = Part("gears", ("load_friction",), (0.1,), gears=True)
RESTING = 4e-6  # rad^2: a joint that rests on the other side of its friction, 2 mrad away


def errors(rng: np.random.Generator, size: float) -> np.ndarray:
    """Mean squares of 60 blocks of one joint [rad^2], shape (60, 1)."""
    return size**2 * rng.chisquare(20, (60, 1)) / 20


def test_few_blocks_in_which_a_joint_rests_elsewhere_are_no_gap() -> None:
    before = errors(np.random.default_rng(0), 1e-4)
    after = before.copy()
    before[[5, 20, 33]] = RESTING

    assert gain(before, after)[0] < 0.2  # of mean squares it would be 1.5
    assert sureness(before, after)[0] < 3.0
    assert typical(before)[0] < 1.3e-4


def test_an_effect_in_all_blocks_counts_whole() -> None:
    rng = np.random.default_rng(1)
    before, after = errors(rng, 2e-4), errors(rng, 1e-4)

    np.testing.assert_allclose(gain(before, after), np.log(2.0), atol=0.1)
    assert sureness(before, after)[0] > 10.0
    np.testing.assert_allclose(explained(before, after), np.sqrt(3.0) * 1e-4, rtol=0.1)


@dataclass(frozen=True, kw_only=True)
class Line(Setup):
    """Positions of each joint that are a straight line in two of its settings, and nothing else."""

    slopes: np.ndarray
    told: np.ndarray

    def residuals_of(self, some: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [self.residuals(settings) for settings in some]

    def residuals(self, settings: np.ndarray) -> np.ndarray:
        """What was told less the line, shape (S, n)."""
        return self.told[:, None] - self.slopes @ settings[ROWS]


ROWS = [ROW["zero"], ROW["load_friction"]]
SCALES = np.array([QUANTITIES[r].scale for r in ROWS])


def unfitted(
    slopes: np.ndarray, told: np.ndarray, joints: int = 1, step: float = 0.0
) -> tuple[Line, Fit]:
    """Joints, read in steps, that are all told the same, and a fit of what does nothing to them."""
    t = np.arange(len(told)) / 50
    motion = Motion(t, t, told[:, None], told[:1], np.zeros(1))
    args = None, np.empty(0), np.array([True]), (MotionSegment(motion, told[:, None]),), 0.002
    setup = Line(*args, np.array([step]), slopes=slopes, told=told)
    start = neutral(joints)
    free = np.zeros(start.shape, dtype=bool)
    free[ROW["delay"]] = True
    return setup, Fit(start, free, setup.residuals(start), 0.0, 1)


def test_a_stretch_that_is_left_out_is_predicted_as_a_fit_of_the_others_would() -> None:
    rng, count = np.random.default_rng(2), 600
    t = np.arange(count) / 50
    slopes = np.column_stack([np.sin(t), np.linspace(0.0, 1.0, count)])
    told = slopes @ [0.1, 0.4] + 1e-3 * rng.standard_normal(count)
    motion = Motion(t, t, told[:, None], told[:1], np.zeros(1))
    segments = (MotionSegment(motion, told[:, None]),)
    args = None, np.empty(0), np.array([True]), segments, 0.002
    setup = Line(*args, slopes=slopes, told=told)
    prior = Prior(neutral(1), np.full((len(QUANTITIES), 1), 3.0), np.full(len(QUANTITIES), np.inf))
    X, at_once = slopes * SCALES, 2

    def fitted(kept: np.ndarray, belief: float) -> np.ndarray:
        H = X[kept].T @ X[kept] + belief * np.eye(2)
        return SCALES * np.linalg.solve(H, X[kept].T @ told[kept])

    settings, free = neutral(1), np.zeros((len(QUANTITIES), 1), dtype=bool)
    free[ROWS] = True
    settings[ROWS, 0] = fitted(np.ones(count, dtype=bool), 0.0)
    found = Fit(settings, free, setup.residuals(settings), 0.0, 1)
    belief = np.mean(found.residuals**2) * count * MEMORY_S / setup.seconds / 9.0
    edges, errors = blocks(setup), left_out(setup, found, prior)
    for k in range(0, len(edges) - 1, at_once):
        a, b = edges[k], edges[min(k + at_once, len(edges) - 1)]
        kept = np.ones(count, dtype=bool)
        kept[a:b] = False
        off = (told - slopes @ fitted(kept, belief))[a : edges[k + 1]]
        np.testing.assert_allclose(errors[k, 0], np.mean(off**2), rtol=1e-3)


@dataclass(frozen=True)
class ReachedOnce(Setup):
    """Positions that a torque limit moves from 2 s to 4 s only, and that are 50 mrad off there."""

    def residuals_of(self, some: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [self.residuals(settings) for settings in some]

    def residuals(self, settings: np.ndarray) -> np.ndarray:
        """Measured less simulated positions [rad], shape (600, 1)."""
        left = np.zeros((600, 1))
        left[100:200] = 0.05 - 0.1 * np.log(settings[ROW["torque_limit"]] / 9.0)
        return left


def test_what_one_stretch_alone_shows_is_followed_as_far_as_its_first_order_holds() -> None:
    """All others know nothing of the limit, which would go anywhere."""
    t = np.arange(600) / 50
    motion = Motion(t, t, t[:, None], np.zeros(1), np.zeros(1))
    segments = (MotionSegment(motion, t[:, None]),)
    setup = ReachedOnce(None, np.empty(0), np.array([True]), segments, 0.002)
    settings, free = neutral(1), np.zeros((len(QUANTITIES), 1), dtype=bool)
    settings[ROW["torque_limit"]], free[ROW["torque_limit"]] = 9.0, True
    prior = Prior(settings, np.full(settings.shape, 3.0), np.full(len(QUANTITIES), np.inf))
    made = left_out(setup, Fit(settings, free, setup.residuals(settings), 0.0, 1), prior)
    assert np.sqrt(made.max()) == pytest.approx(0.15, abs=0.01)


def test_what_helps_nearly_surely_is_suspected() -> None:
    """At joints where something is left; not what came out at nothing."""
    rng, start = np.random.default_rng(12), neutral(1)
    before = errors(rng, 2e-4)
    for size, rough, told in ((0.05, 1.2, True), (0.0, 1.2, False), (0.05, 20.0, False)):
        noise = rng.standard_normal(before.shape)
        after = before * np.exp(-0.8 - rough * (noise - noise.mean()))
        found = Fit(sized(start, GEARS, size), start > 0.0, np.zeros((1, 1)), 0.0, 1)
        trial = Trial(GEARS, np.ones(1, dtype=bool), found, after, gain(before, after))
        end = SimpleNamespace(errors=before, tried=(trial,))
        search = SimpleNamespace(end=end, asked={GEARS: None}, least=lambda *_: 0.03)
        suspected = nearly_sure(search, [0], SearchSettings())
        assert [s.effect.part for s in suspected] == [GEARS] * told
        assert nearly_sure(search, [], SearchSettings()) == ()


def test_no_prediction_is_better_than_the_encoder() -> None:
    """Where a joint rests, chance decides how near to the step that was read a prediction comes."""
    rng, count, step = np.random.default_rng(5), 600, 1e-3
    t = np.arange(count) / 50
    told = np.where(t < 6.0, 1e-3 * rng.standard_normal(count), 0.0)
    motion = Motion(t, t, told[:, None], told[:1], np.zeros(1))
    args = None, np.empty(0), np.array([True]), (MotionSegment(motion, told[:, None]),), 0.002
    off, free = neutral(1), np.zeros((len(QUANTITIES), 1), dtype=bool)
    free[ROW["delay"]] = True
    off[ROW["zero"]] = 1e-4  # within the step, at rest and in motion
    prior = Prior(neutral(1), np.full((len(QUANTITIES), 1), 3.0), np.full(len(QUANTITIES), np.inf))
    for resolution, lost in ((0.0, 1.0), (step, 0.01)):
        setup = Line(*args, np.array([resolution]), slopes=np.ones((count, 2)), told=told)
        before, after = (
            left_out(setup, Fit(at, free, setup.residuals(at), 0.0, 1), prior)
            for at in (neutral(1), off)
        )
        assert (-gain(before, after)[0] > lost) == (resolution == 0.0)


def sized(settings: np.ndarray, part: Part, size: float = 0.05) -> np.ndarray:
    """Settings in which a part is of some size."""
    made = settings.copy()
    made[ROW[part.quantities[0]]] = size
    return made


def test_what_servos_of_one_kind_have_is_asked_of_all_joints_together() -> None:
    """Half of them say so; where something else comes first, and is not sure, it keeps out none."""
    rng, start = np.random.default_rng(6), neutral(4)
    before = np.hstack([errors(rng, 2e-4) for _ in range(4)])
    gains = {PROFILE: np.array([0.5, 0.4, 0.6, 0.01]), LIMIT: np.array([0.0, 0.0, 0.7, 0.3])}
    free = np.zeros(start.shape, dtype=bool)
    made = []
    for part, gained in gains.items():
        rough = np.exp(rng.standard_normal(before.shape) * (6.0 if part is LIMIT else 0.1))
        after = before * np.exp(-2.0 * gained) * rough
        found = Fit(sized(start, part), free, np.zeros((1, 4)), 0.0, 1)
        made.append(Trial(part, np.ones(4, dtype=bool), found, after, gained))
    for alike in (True, False):
        begun = SimpleNamespace(same_servo=alike, resolution=np.zeros(4))
        won = winners(made, before, {}, begun, SearchSettings())
        names = sorted((a.part.name, a.joint) for a in won)
        assert names == [("profile", j) for j in ((0, 1, 2, 3) if alike else (0, 1, 2))]


@pytest.mark.parametrize("alike", [True, False])
@pytest.mark.parametrize("gains", [(0.25, 0.2, 0.28, 0.05), (0.0, 0.0, 1.0, 0.0)])
def test_what_gears_have_is_asked_of_all_joints_or_of_one(
    gains: tuple[float, ...], alike: bool
) -> None:
    """Servos of one kind have the same gears: together they are sure of what none is alone."""
    rng, start = np.random.default_rng(9), neutral(4)
    before = np.hstack([errors(rng, 2e-4) for _ in range(4)])
    after = before * np.exp(-2.0 * np.array(gains) + 1.2 * rng.standard_normal(before.shape))
    assert (sureness(before, after)[[0, 1, 3]] < SearchSettings().sure).all()
    settings = sized(start, GEARS)
    found = Fit(settings, np.zeros(start.shape, dtype=bool), np.zeros((1, 4)), 0.0, 1)
    made = [Trial(GEARS, np.ones(4, dtype=bool), found, after, gain(before, after))]
    may = np.ones(start.shape, dtype=bool)
    begun = SimpleNamespace(same_servo=alike, resolution=np.zeros(4), may=may)
    won = [(a.joint, a.of_all) for a in winners(made, before, {}, begun, SearchSettings())]
    if gains[2] == 1.0:
        assert won == [(2, False)]
    else:
        assert won == ([(j, True) for j in range(4)] if alike else [])


@pytest.mark.parametrize(("second", "named"), [(OFFSET, []), (SPEED, ["profile_speed"])])
def test_an_unsure_part_of_the_servo_keeps_out_effects_but_no_sure_part_of_it(
    second: Part, named: list[str]
) -> None:
    """An effect that explains less than what the servo may have is no name."""
    rng, start = np.random.default_rng(8), neutral(1)
    before, made = errors(rng, 2e-4), []
    for part, gained, rough in ((LIMIT, 0.6, 6.0), (second, 0.4, 0.1)):
        after = before * np.exp(-2.0 * gained + rough * rng.standard_normal(before.shape))
        found = Fit(sized(start, part), np.zeros(start.shape, dtype=bool), np.zeros((1, 1)), 0.0, 1)
        made.append(Trial(part, np.ones(1, dtype=bool), found, after, np.array([gained])))
    begun = SimpleNamespace(same_servo=False, resolution=np.zeros(1))
    assert [a.part.name for a in winners(made, before, {}, begun, SearchSettings())] == named


@pytest.mark.parametrize(
    ("offset", "spring", "named"),
    [(0.58, 0.05, "offset"), (0.3, 0.05, "spring"), (0.3, 0.0, "offset")],
)
def test_a_spring_is_no_name_for_what_an_offset_explains_as_well(
    offset: float, spring: float, named: str
) -> None:
    """It holds an offset, so that it always explains a little more; without stiffness it is one."""
    rng, start = np.random.default_rng(3), neutral(1)
    before, made = errors(rng, 2e-4), []
    for part, gained in ((SPRING, 0.6), (OFFSET, offset)):
        after = before * np.exp(-2.0 * gained + 0.1 * rng.standard_normal(before.shape))
        settings = sized(start, part, spring if part is SPRING else 0.05)
        found = Fit(settings, np.zeros(start.shape, dtype=bool), np.zeros((1, 1)), 0.0, 1)
        made.append(Trial(part, np.ones(1, dtype=bool), found, after, np.array([gained])))
    begun = SimpleNamespace(same_servo=False, resolution=np.zeros(1))
    assert [a.part.name for a in winners(made, before, {}, begun, SearchSettings())] == [named]


@pytest.mark.parametrize(
    ("servo", "told", "sizes"),
    [(False, 0.11, [0.1, 0.3]), (False, 0.7, [0.8, 0.3]), (True, 0.11, [0.1])],
)
def test_a_fit_begins_at_the_best_size_and_at_the_next_larger_one(
    servo: bool, told: float, sizes: list[float]
) -> None:
    """From the best one it may stay where the arm was without the part."""
    t = np.arange(600) / 50
    slopes = np.column_stack([np.zeros(600), np.sin(3.0 * t)])
    setup, best = unfitted(slopes, slopes @ [0.0, told])
    part = Part("own", ("load_friction",), (0.1, 0.3, 0.8), servo=servo)
    prior = Prior(neutral(1), np.full((len(QUANTITIES), 1), 3.0), np.full(len(QUANTITIES), np.inf))
    starts = scanned(setup, best, part, np.array([True]), prior)
    np.testing.assert_allclose([s[ROW["load_friction"], 0] for s in starts], sizes)


def test_a_part_of_the_servo_is_tried_beside_one_that_promises_more() -> None:
    """It moves a joint too far for the first order to say which of two is better."""
    rng, count = np.random.default_rng(4), 600
    t = np.arange(count) / 50
    slopes = np.column_stack([np.sin(3.0 * t), np.cos(5.0 * t)])
    told = slopes @ [0.3, 0.1] + 0.1 * rng.standard_normal(count)
    setup, best = unfitted(slopes, told)
    large, small = Part("large", ("zero",), (0.3,)), Part("small", ("load_friction",), (0.1,))
    for servo in (False, True):
        asked = {part: np.array([True]) for part in (large, replace(small, servo=servo))}
        tried = [places.item() for places in promising(setup, best, asked, LOW).values()]
        assert tried == [True, servo]


def test_what_gears_have_is_tried_at_all_joints_if_together_they_promise_enough() -> None:
    """Each of them promises less than what one joint alone would have to."""
    rng, count = np.random.default_rng(4), 600
    t = np.arange(count) / 50
    slopes = np.column_stack([np.sin(3.0 * t), np.cos(5.0 * t)])
    told = slopes @ [0.0, 0.03] + 0.1 * rng.standard_normal(count)
    setup, best = unfitted(slopes, told, 3)
    for gears in (False, True):
        for alike in (False, True):
            asked = {replace(GEARS, gears=gears): np.ones(3, dtype=bool)}
            places = promising(setup, best, asked, LEAST, same_servo=alike).values()
            assert [p.tolist() for p in places] == [[gears and alike] * 3]


@pytest.mark.parametrize(("step", "common"), [(0.01, False), (1.0, False), (0.01, True)])
def test_where_a_joint_is_far_off_its_servo_is_asked_whatever_it_promises(
    step: float, common: bool
) -> None:
    """First order tells nothing there; of what joints share, one that is far off tells nothing."""
    rng, count = np.random.default_rng(7), 600
    t = np.arange(count) / 50
    slopes = np.column_stack([np.sin(3.0 * t), np.zeros(count)])
    told = 0.1 * rng.standard_normal(count)
    setup, best = unfitted(slopes, told, step=step)
    asked = {
        Part("own", ("load_friction",), (0.1,), servo=servo, common=common): np.array([True])
        for servo in (False, True)
    }
    tried = [places.item() for places in promising(setup, best, asked, LOW).values()]
    assert tried == [False, step < 0.1 and not common]


@pytest.mark.parametrize(("floor", "tried"), [(None, False), (0.08, False), (0.05, True)])
def test_where_something_is_missing_for_sure_all_is_tried_whatever_it_promises(floor, tried):
    rng, count = np.random.default_rng(7), 600
    told = 0.1 * rng.standard_normal(count)
    setup, best = unfitted(np.zeros((count, 2)), told)
    known = None if floor is None else np.array([floor])
    found = Selection(setup, best, errors(rng, 0.1), floor=known)
    asked = {Part("own", ("load_friction",), (0.1,)): np.array([True])}
    worth = worth_a_fit(found, asked, LOW, same_servo=False)
    assert [places.item() for places in worth.values()] == [tried]


def test_what_other_joints_gain_by_a_zero_counts_at_its_own() -> None:
    rng = np.random.default_rng(3)
    before = np.hstack([errors(rng, 2e-4) for _ in range(3)])
    after = before * [1.0, 0.5, 0.25]
    place = np.array([False, True, False])

    own, whole = (gain(before, felt(p, place, before, after)) for p in (OFFSET, ENCODER_OFFSET))
    np.testing.assert_allclose(own[1], 0.5 * np.log(2.0))
    np.testing.assert_allclose(whole[1], 0.5 * np.log(8.0))


@pytest.mark.parametrize(
    ("part", "of_all", "deviations", "vague"),
    [
        (OFFSET, False, 1.2, True),
        (OFFSET, False, 4.0, False),
        (LIMIT, False, 1.2, False),
        (GEARS, True, 1.2, False),
    ],
)
def test_an_effect_whose_size_may_be_nothing_does_not_stay_in_the_model(
    part: Part, of_all: bool, deviations: float, vague: bool
) -> None:
    """A limit is told apart by what it does, and what all joints have is asked of them all."""
    known = Knowledge(np.zeros((len(ROW), 2)), np.zeros(2), np.full((len(ROW), 2), 9.0))
    known.deviations[ROW[part.quantities[0]], 1] = deviations
    accepted = Accepted(part, 1, 0.2, 0.02, 0.001, None, (), of_all)
    assert is_vague(accepted, known, SearchSettings()) is vague
