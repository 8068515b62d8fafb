"""A joint zero that is off by more than torque is linear in, beside a model made before."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import estimates_of, recorded, source_of, wam

from ident.dynamics.regressor import Motion
from ident.effects.bound_effects import BoundEffects
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import read_experiment, with_reference_model
from ident.gap.options import Options
from ident.gap.search import search
from ident.identification.identify import identify, model_of
from wamctl.arm.errors import DataError
from wamctl.arm.recorder import write_recording

JOINT, TURN = 3, -2.0 * np.pi / 18.0
"""The elbow (from 0), and one turn of its motor there [rad]."""


@pytest.fixture(scope="module")
def known(source):
    return model_of(identify(source.datasets, source.arm))


def test_a_zero_that_is_off_by_a_turn_of_the_motor_is_one_effect(known):
    """The drives read too little by a motor's turn; torque that is linear in it needs four."""
    arm = wam()
    zero = arm.encoder_zero.copy()
    zero[JOINT] += TURN
    log = recorded(replace(arm, encoder_zero=zero), 1)
    found = search(
        with_reference_model(source_of(log), known), Options(null_runs=1), lambda _: None
    )
    assert [(f.candidate.effect, f.candidate.joints) for f in found.verdict.effects] == [
        ("encoder_offset", (JOINT,))
    ]
    assert estimates_of(found)[0]["offset"].value == pytest.approx(TURN, abs=2e-3)


def test_its_torque_is_exact_along_its_own_chord(known):
    """Beside the model's inverse dynamics at both positions; friction is the same at both."""
    effect, rng, n = catalogue()["encoder_offset"], np.random.default_rng(0), known.robot.dof
    q, qd, qdd = rng.normal(size=(3, 5, n))
    here = effect.at((JOINT,), rows=range(n))
    member = (effect.linearised_at(here, np.array([TURN])), np.array([TURN]))
    torque = BoundEffects((member,)).torque(known, Motion(q, qd, qdd), None)
    true = q + TURN * np.eye(n)[JOINT]
    wanted = known.inverse_dynamics(true, qd, qdd) - known.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(torque, wanted, atol=1e-9)


def test_logs_without_an_arm_are_of_the_model_s(source, known, tmp_path):
    log = tmp_path / "bare.mcap"
    write_recording(log, replace(source.recordings[0], attachments={}))
    with pytest.raises(DataError, match="--robot"):
        read_experiment([log])
    assert read_experiment([log], known=source.arm).arm is source.arm
