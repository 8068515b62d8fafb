"""What a search and a fit try, and what they need not try again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from servo_arm import JOINTS, URDF, recording

from ident.model.arm import arm_from_urdf
from ident.output_error.changed_gains import changed_gain
from ident.output_error.first_guess import neutral
from ident.output_error.fit import Fit, fit
from ident.output_error.judging import gain, sureness
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.prepared import prepared, searched
from ident.output_error.recordings import segments_of
from ident.output_error.search.again import still_hold, with_new_ones
from ident.output_error.search.parts import LOAD_FRICTION, OFFSET, ZEROS, Part
from ident.output_error.search.selection import Selection, bare
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Trial
from ident.output_error.setup import MotionSegment, Prior, Setup
from ident.output_error.uncertainty import knowledge
from ident.workflows.output_error.commands import gain_remarks

NEW = "torque_limit"


def selection(errors: np.ndarray, changed: Sequence[int] = ()) -> Selection:
    """An arm of three joints, some of which have been changed."""
    settings = neutral(3)
    settings[ROW["stiffness"], list(changed)] *= 1.1
    free = np.zeros(settings.shape, dtype=bool)
    free[ROW[NEW], list(changed)] = True
    return Selection(None, Fit(settings, free, np.zeros((1, 3)), 0.0, 1), errors)


def trial(part: Part, errors: np.ndarray, after: np.ndarray, places: Sequence[bool]) -> Trial:
    """A part that was tried at some joints."""
    at = np.array(places)
    after = np.where(at, after, errors)
    fitted = selection(errors).fit
    fitted = replace(fitted, settings=np.where(at, 2.0, fitted.settings))
    return Trial(part, at, fitted, after, np.where(at, gain(errors, after), 0.0))


@pytest.mark.parametrize(
    ("part", "alike", "holds"),
    [(OFFSET, False, True), (OFFSET, True, True), (ZEROS, False, False)],
)
def test_what_was_tried_holds_at_joints_that_stayed(part: Part, alike: bool, holds: bool) -> None:
    """With the same gain, as sure, though another joint moved this one by next to nothing."""
    rng = np.random.default_rng(1)
    errors = rng.chisquare(20, (60, 3))
    tried = trial(part, errors, 0.5 * rng.chisquare(20, (60, 3)), [True, True, False])
    now = selection(errors * (1.0 + 0.02 * rng.standard_normal(errors.shape)), changed=[0])
    kept = still_hold(
        replace(selection(errors), tried=(tried,)), now, SimpleNamespace(same_servo=alike)
    )
    if not holds:
        assert not kept
        return
    (again,) = kept
    assert again.places.tolist() == [False, True, False]
    np.testing.assert_allclose(gain(now.errors, again.errors)[1], tried.gain[1])
    np.testing.assert_allclose(
        sureness(now.errors, again.errors)[1], sureness(errors, tried.errors)[1]
    )


def test_what_servos_of_one_kind_have_is_tried_again() -> None:
    errors = np.random.default_rng(2).chisquare(20, (60, 3))
    tried = trial(replace(OFFSET, gears=True), errors, 0.5 * errors, [True, True, False])
    found = replace(selection(errors), tried=(tried,))
    now = selection(errors, changed=[0])
    assert not still_hold(found, now, SimpleNamespace(same_servo=True))
    assert still_hold(found, now, SimpleNamespace(same_servo=False))


def test_old_and_new_trials_of_a_part_are_one() -> None:
    errors = np.random.default_rng(3).chisquare(20, (60, 3))
    old = trial(OFFSET, errors, 0.5 * errors, [False, True, False])
    new = trial(OFFSET, errors, 0.25 * errors, [True, False, False])
    other = trial(LOAD_FRICTION, errors, 0.9 * errors, [True, True, True])
    made, kept = with_new_ones([old, other], [new])
    assert kept is other
    assert made.places.tolist() == [True, True, False]
    np.testing.assert_allclose(made.gain, [np.log(2.0), 0.5 * np.log(2.0), 0.0])
    np.testing.assert_allclose(gain(errors, made.errors), made.gain)


BENDS = np.array([0.1, 4.0])


@dataclass(frozen=True, kw_only=True)
class Bent(Setup):
    """Positions of each joint that follow one of its settings, bent by another share each."""

    asked: list[int]

    def residuals_of(self, some: Sequence[np.ndarray]) -> list[np.ndarray]:
        self.asked.append(len(some))
        x = np.array([s[ROW["zero"]] for s in some])
        t = np.arange(300)[:, None] / 50
        noise = 1e-4 * np.cos(7.0 * t)
        return [np.sin(3.0 * t) * np.sinh(BENDS * (v - 0.5)) + noise for v in x]


def test_dampings_are_tried_side_by_side() -> None:
    """One is all but straight, the other bent: some are simulated side by side, both come home."""
    n = len(QUANTITIES)
    t = np.arange(300) / 50
    told = np.zeros((300, 2))
    segment = MotionSegment(Motion(t, t, told, told[0], told[0]), told)
    setup = Bent(None, np.empty(0), np.ones(2, dtype=bool), (segment,), 0.002, asked=[])
    free = np.zeros((n, 2), dtype=bool)
    free[ROW["zero"]] = True
    prior = Prior(neutral(2), np.full((n, 2), 30.0), np.full(n, np.inf))
    found = fit(setup, neutral(2), free, prior)
    np.testing.assert_allclose(found.settings[ROW["zero"]], 0.5, atol=2e-2)
    assert 2 in setup.asked  # dampings; columns ask for four


def test_a_servo_whose_gain_was_changed_between_recordings_is_told() -> None:
    arm, settings = arm_from_urdf(URDF, JOINTS, "urdf"), SearchSettings()
    for gains in ((1.0, 1.0, 1.0), (1.0, 2.0, 1.0)):
        told = [recording(14.0, k, gain=gains[k]) for k in range(3)]
        begun = prepared(
            arm, [s for k, r in enumerate(told) for s in segments_of(r, JOINTS, f"log {k}")]
        )
        base = bare(searched(begun.setup), begun, settings.fit_rounds)
        known = knowledge(base.setup, base.fit, begun.prior)
        changed = changed_gain(begun, base.fit, known, settings)
        if gains[1] == 1.0:
            assert changed is None
            assert not gain_remarks(changed, JOINTS)
            continue
        assert changed is not None
        assert (changed.joint, changed.more) == (1, "log 1")
        assert changed.factor == pytest.approx(2.0, rel=0.15)
        unweighed = replace(known, torque_factor_sd=np.full(2, np.inf))
        assert changed_gain(begun, base.fit, unweighed, settings) is None
        (said,) = gain_remarks(changed, JOINTS)
        assert said.code == "recordings_disagree"
        assert "joint 2 (elbow)" in said.sentence
