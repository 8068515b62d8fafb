"""Transients: intervals that are excluded, and intervals that are no events."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.gap.data.noise_regions import Region
from ident.gap.regression.residuals import Residual
from ident.gap.settings import Transients
from ident.gap.transients import detect
from ident.gap.transients.cut_out import cut_out
from ident.gap.transients.detect import Transient, at_end_stop, with_affected_joints
from ident.gap.transients.exclude import Excluded, in_presliding_transient, still_stand_out
from ident.recordings.dataset import Dataset, Segment, in_memory

SETTINGS = Transients()
PUSH = Transient(
    0, 3.0, 4.0, (1,), np.array([2.0]), np.array([0.1]), 0.3, np.zeros(4, dtype=bool), np.ones(4)
)


def test_excess_power_that_repeats_with_the_motion_is_no_transient():
    rows = np.array([False, True, False, False, False, False])
    repeats = np.array([0, 1, 2]), np.array([3, 4, 5])
    once = replace(PUSH, rows=rows, loudness=np.array([1, 50.0, 1, 1, 1, 1]))
    again = replace(once, loudness=np.array([1, 50.0, 1, 1, 40.0, 1]))
    assert not once.repeats_with_motion(repeats, SETTINGS.repeat_share)
    assert again.repeats_with_motion(repeats, SETTINGS.repeat_share)
    assert not again.repeats_with_motion((repeats[0][:1], repeats[1][:1]), 0.1)


def test_an_unknown_presliding_state_is_no_transient():
    t = np.arange(0.0, 6.0, 0.01)
    q = np.column_stack([0.1 * t, np.zeros_like(t)])
    rows = SimpleNamespace(segments=(SimpleNamespace(log=0, t=t, q=q),))
    effect = catalogue()["presliding"]
    bristle = effect.at((0,), effect.Parameters(0.01), "dahl")
    now, none = SimpleNamespace(accepted=(bristle,)), SimpleNamespace(accepted=())
    early = replace(PUSH, joints=(0,), start_s=0.2, end_s=0.8)
    assert in_presliding_transient(rows, now, early, SETTINGS)
    assert not in_presliding_transient(rows, now, replace(early, end_s=1.5), SETTINGS)
    assert not in_presliding_transient(rows, now, replace(early, joints=(1,)), SETTINGS)
    assert not in_presliding_transient(rows, now, replace(early, log=1), SETTINGS)
    assert not in_presliding_transient(rows, none, early, SETTINGS)


def test_very_many_or_very_long_transients_are_no_events():
    rows = SimpleNamespace(excluded=PUSH.rows)
    many = Excluded(rows, None, SETTINGS.max_count * (PUSH,))
    assert not still_stand_out(many, 0.1, SETTINGS)
    most = SimpleNamespace(excluded=np.ones(4, dtype=bool))
    assert not still_stand_out(Excluded(most, None, (PUSH,)), 0.1, SETTINGS)


def test_transients_beyond_every_free_position_may_be_an_end_stop():
    t = np.arange(0.0, 20.0, 0.01)
    swing = np.pi * t / 4
    q = np.column_stack([np.cos(0.7 * t), np.sin(swing)])
    qd = np.column_stack([-0.7 * np.sin(0.7 * t), np.pi / 4 * np.cos(swing)])
    rows = SimpleNamespace(segments=(SimpleNamespace(log=0, t=t, q=q, qd=qd),))
    tops = [replace(PUSH, start_s=at - 0.5, end_s=at + 0.5) for at in (2.0, 10.0, 18.0)]
    assert at_end_stop(rows, tops, SETTINGS) == (1,)
    assert at_end_stop(rows, tops[1:], SETTINGS) == ()
    assert at_end_stop(rows, tops[:1], SETTINGS) == ()
    assert at_end_stop(rows, [replace(b, joints=(0,)) for b in tops], SETTINGS) == ()
    elsewhere = [replace(b, start_s=b.start_s + 1.0, end_s=b.end_s + 1.0) for b in tops]
    assert at_end_stop(rows, elsewhere, SETTINGS) == ()
    leaning = SimpleNamespace(log=1, t=t, q=np.ones_like(q), qd=np.zeros_like(q))
    assert at_end_stop(SimpleNamespace(segments=(*rows.segments, leaning)), tops, SETTINGS) == (1,)


def test_a_joint_is_affected_where_it_slides_and_by_torque_that_counts(monkeypatch):
    def residual(torque: float, region: Region) -> Residual:
        values = np.array([0.0, torque, torque, 0.0])
        return Residual(values, np.full(4, region), np.zeros(4, int), np.zeros(4, bool))

    found = [
        residual(2.0, Region.SLIDING),
        residual(2.0, Region.REVERSAL),  # dry friction may answer the push
        residual(1e-3, Region.SLIDING),  # loud in a simulation without noise, and next to nothing
    ]
    monkeypatch.setattr(detect, "residuals", lambda design, fit: found)
    fit = SimpleNamespace(sigma=np.full((3, 3), 1e-5), coulomb=np.array([1.0, 1.0, 1.0]))
    current = SimpleNamespace(design=lambda rows: None, fit=fit)
    event = replace(PUSH, rows=np.array([False, True, True, False]))
    (told,) = with_affected_joints(None, [event], current, SETTINGS)
    assert told.joints == (0,)
    assert told.torque.tolist() == [2.0]  # of each joint that is told


def test_a_push_is_measured_by_what_the_residual_means_elsewhere(monkeypatch):
    """A wrong model is loudest somewhere, and has no more torque there than elsewhere."""
    n, push = 400, slice(100, 110)
    ringing, steady = np.zeros(n), 0.1 * np.sin(np.arange(n))
    ringing[push], steady[push] = 5.0 * (-1.0) ** np.arange(10), 5.0
    ringing += 0.5 * np.sin(np.arange(n) / 20.0)
    sliding, none = np.full(n, Region.SLIDING), np.zeros(n, dtype=bool)
    found = [Residual(v, sliding, np.zeros(n, int), none) for v in (ringing, steady)]
    monkeypatch.setattr(detect, "residuals", lambda design, fit: found)
    fit = SimpleNamespace(sigma=np.full((2, 3), 0.1), coulomb=np.ones(2))
    current = SimpleNamespace(design=lambda rows: None, fit=fit)
    rows = np.zeros(n, dtype=bool)
    rows[push] = True
    (event,) = with_affected_joints(None, [replace(PUSH, rows=rows)], current, SETTINGS)
    assert event.joints == (0, 1)
    assert event.sd == pytest.approx([0.5 / np.sqrt(3.0), 0.0], abs=0.03)
    assert event.at_sure_joints(3.0).joints == (1,)
    first = replace(event, joints=(0,), torque=event.torque[:1], sd=event.sd[:1])
    assert first.at_sure_joints(3.0) is None


def test_the_time_of_a_push_is_cut_out_of_its_recording():
    t = np.arange(600) / 100.0
    whole = Segment(0.5, np.column_stack([t, t]), np.ones((600, 2)), used=(50, 550))
    moving = np.ones(2, dtype=bool)
    rest = ("measured", np.zeros(2), moving, False, (), None, lambda: iter(()))
    data = in_memory(Dataset("log", 100.0, (), *rest), 100.0, [whole])
    assert cut_out(data, 1, [PUSH]) is data
    before, after = cut_out(data, 0, [PUSH]).segments
    assert (before.start_s, len(before.q), before.used) == (0.5, 250, (50, 250))
    assert (after.start_s, len(after.q), after.used) == (4.0, 250, (0, 200))
    assert after.q[0, 0] == pytest.approx(3.5)
