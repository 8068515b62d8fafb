"""Terms on demand: what is in the arm is taken into the model, and nothing else."""

import numpy as np
import pytest
from synthetic_arm import motion, recording

from ident.estimation.regression_data import reduce_recordings
from ident.identification.cross_validation import left_out_sums
from ident.identification.term_selection import trial, with_needed_terms
from ident.recordings.dataset import dataset
from ident.regression.squared_errors import Sums, added

ROTORS = np.array([0.08, 0.08, 0.08, 0.1, 0.02, 0.02, 0.002])
OFFSETS = np.array([0.5, -0.8, 0.3, 0.2, 0.05, -0.05, 0.01])


def measured(wam, offset=0.0, rotors=0.0):
    t, q, qd, qdd = motion(20.0, 250.0)
    rng = np.random.default_rng(3)
    noise = np.array([2.0, 2.0, 1.0, 1.0, 0.2, 0.2, 0.1]) * rng.normal(size=q.shape)
    tau = wam.torque(q, qd, qdd) + offset + rotors * qdd + noise
    counts = 2 * np.pi / (4096 * 20)
    names = wam.arm.robot.joint_names
    return dataset(recording(names, t, np.round(q / counts) * counts, tau), names, "log")


def chosen(wam, data):
    arm = wam.arm.with_settings(terms=("viscous", "coulomb", "auto"))
    evidence, trials = with_needed_terms([data], arm)
    return evidence.arm, trials


def test_an_arm_that_obeys_the_papers_model_gets_no_other_term(wam):
    arm, trials = chosen(wam, measured(wam))
    assert arm.settings.terms == ("viscous", "coulomb")
    assert [(t.term, t.taken) for t in trials] == [("offset", False), ("rotor_inertia", False)]


def test_offsets_are_found(wam):
    arm, trials = chosen(wam, measured(wam, offset=OFFSETS))
    assert arm.settings.terms == ("viscous", "coulomb", "offset")
    assert arm.terms.offset
    assert not arm.terms.rotor_inertia
    assert trials[0].taken
    assert trials[0].gain_percent > 2 * trials[0].sd_percent


@pytest.mark.parametrize(("other", "taken"), [(0.0, False), (2 * OFFSETS, True)])
def test_a_term_about_which_recordings_contradict_each_other_is_not_taken(wam, other, taken):
    """Half of each other's offset still predicts both better than none, when both are fitted."""
    arm = wam.arm.with_settings(terms=("viscous", "coulomb", "auto"))
    data = [measured(wam, offset=2 * OFFSETS), measured(wam, offset=other)]
    evidence, trials = with_needed_terms(data, arm)
    offset = next(t for t in trials if t.term == "offset")
    assert offset.gain_percent > 2 * offset.sd_percent
    assert (offset.taken, offset.contradicted) == (taken, not taken)
    assert evidence.arm.terms.offset == taken


@pytest.mark.parametrize(("thirds", "helps"), [((1, -1, 1), False), ((1, 1, 1), True)])
def test_thirds_of_a_recording_tell_whether_an_offset_is_one(wam, thirds, helps):
    third = (3 * np.arange(5000)) // 5000
    data = [measured(wam, offset=3 * OFFSETS * np.array(thirds)[third][:, None])]
    left = [
        added(left_out_sums(reduce_recordings(data, wam.arm.with_settings(terms=terms)), "ols"))
        for terms in (("viscous", "coulomb"), ("viscous", "coulomb", "offset"))
    ]
    without, having = (s.errors().relative_percent for s in left)
    assert left[0].rows.tolist() == left[1].rows.tolist()
    assert (having < without) == helps


def test_rotors_of_an_arm_whose_links_cannot_have_them_are_found(wam):
    """Rotors as heavy as the links: an inertia about the joint alone, which no link can have."""
    arm, _ = chosen(wam, measured(wam, rotors=5 * ROTORS))
    assert arm.settings.terms == ("viscous", "coulomb", "rotor_inertia")


def test_terms_that_are_given_are_kept(wam):
    arm = wam.arm.with_settings(terms=("viscous", "coulomb"))
    evidence, trials = with_needed_terms([measured(wam, offset=OFFSETS)], arm)
    assert (evidence.arm, trials) == (arm, ())


@pytest.mark.parametrize(("left", "taken"), [(0.997, False), (0.97, True)])
def test_a_sure_gain_that_is_tiny_is_no_reason_for_a_term(left, taken):
    """The same part of the error in every stretch, as where a motion is repeated."""
    errors = np.random.default_rng(0).uniform(1.0, 2.0, (36, 7))
    before = [Sums(e, 1e4 * np.ones(7), np.full(7, 100)) for e in errors]
    after = [Sums(left**2 * e, 1e4 * np.ones(7), np.full(7, 100)) for e in errors]
    tried = trial("offset", before, after)
    assert tried.gain_percent > 2 * tried.sd_percent
    assert tried.taken == taken


def test_rows_reduced_once_for_all_terms_are_those_of_the_chosen_terms(wam):
    data = measured(wam, rotors=5 * ROTORS)
    arm = wam.arm.with_settings(terms=("viscous", "coulomb", "auto"))
    evidence, _ = with_needed_terms([data], arm)
    alone = reduce_recordings([data], evidence.arm)
    assert evidence.base.names == alone.base.names
    for one, other in ((evidence.by_joint, alone.by_joint), (evidence.triangles, alone.triangles)):
        a, b = (np.swapaxes(R, -1, -2) @ R for R in (one, other))
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * np.abs(b).max())
    np.testing.assert_array_equal(evidence.logs[0].reduction.W_sign, alone.logs[0].reduction.W_sign)


def test_settings_that_nobody_set_stay_so(wam):
    """A search reads from it whether the arm's file asks for terms."""
    changed = wam.arm.with_settings(cutoff_hz=7.0).with_settings(terms=("viscous", "coulomb"))
    assert changed.settings.model_fields_set - wam.arm.settings.model_fields_set == {
        "cutoff_hz",
        "terms",
    }
