"""Terms on demand: what is in the arm is taken into the model, and nothing else."""

import numpy as np
from synthetic_arm import motion, recording

from ident.identification.term_selection import with_needed_terms
from ident.recordings.dataset import dataset

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
    return with_needed_terms([data], wam.arm.with_settings(terms=("viscous", "coulomb", "auto")))


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


def test_rotors_of_an_arm_whose_links_cannot_have_them_are_found(wam):
    """Rotors as heavy as the links: an inertia about the joint alone, which no link can have."""
    arm, _ = chosen(wam, measured(wam, rotors=5 * ROTORS))
    assert arm.settings.terms == ("viscous", "coulomb", "rotor_inertia")


def test_terms_that_are_given_are_kept(wam):
    data = measured(wam, offset=OFFSETS)
    assert with_needed_terms([data], wam.arm) == (wam.arm, ())


def test_settings_that_nobody_set_stay_so(wam):
    """A search reads from it whether the arm's file asks for terms."""
    changed = wam.arm.with_settings(cutoff_hz=7.0).with_settings(terms=("viscous", "coulomb"))
    assert changed.settings.model_fields_set - wam.arm.settings.model_fields_set == {
        "cutoff_hz",
        "terms",
    }
