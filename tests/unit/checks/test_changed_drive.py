"""A drive that gives another torque than when the arm was identified: `ident gap --model`."""

import numpy as np
import pytest
from chain_arm import Experiment, Log, motion

from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.options import Options
from ident.identification.validation import arm_of, predict
from ident.model.identified_model import Model
from ident.workflows.gap import gap_of
from ident.workflows.run import run_data

JOINT, ROTOR, OFFSET = 1, np.array([0.4, 0.8, 0.3]), np.array([1.0, -3.0, 0.5])


def recorded(seed: int, gain: float) -> Log:
    """An arm with rotors and offsets, one of whose torques is told too large or too small."""
    experiment = Experiment(seconds=40.0, seed=seed)
    log = experiment.log()
    _, _, qdd = motion(log.t, 3, np.random.default_rng(seed), experiment.speed)
    tau = log.tau + ROTOR * qdd + OFFSET
    return log.with_(tau=tau * np.where(np.arange(3) == JOINT, gain, 1.0))


@pytest.fixture(scope="module")
def trusted() -> Model:
    log = recorded(0, 1.0)
    arm = log.arm().with_settings(terms=["viscous", "coulomb", "offset", "rotor_inertia"])
    return run_data(arm, [log.dataset(arm)]).model


@pytest.mark.parametrize("gain", [1.5, 0.5])
def test_its_whole_torque_changes_rotor_offset_and_friction_with_it(trusted, gain) -> None:
    log = recorded(1, gain)
    source = with_reference_model(of_arm(log.arm(), None, [log.recording()], ["log"]), trusted)
    done = gap_of(source, Options(null_runs=0), lambda *told: None)
    (effect,) = done.content["effects"]
    assert (effect["name"], effect["joints"]) == ("torque_gain", [JOINT + 1])
    assert effect["parameters"]["error"]["value"] == pytest.approx(1 / gain - 1, abs=0.02)
    arm = arm_of(done.model)
    left = predict(done.model, arm, log.dataset(arm)).filtered["feasible"]
    assert left.relative_percent < 3.0
    assert done.model.parameter("fo")[JOINT] == pytest.approx(gain * OFFSET[JOINT], abs=0.5)


@pytest.mark.parametrize("factor", [1.2, 0.7])
def test_one_factor_at_all_joints_is_no_load(trusted, factor) -> None:
    """A mass at the tool and one joint's gain explained it, with 28 standard deviations."""
    log = recorded(1, 1.0)
    log = log.with_(tau=factor * log.tau)
    source = with_reference_model(of_arm(log.arm(), None, [log.recording()], ["log"]), trusted)
    done = gap_of(source, Options(null_runs=0), lambda *told: None)
    (effect,) = done.content["effects"]
    assert (effect["name"], effect["joints"]) == ("torque_gain", [1, 2, 3])
    assert effect["parameters"]["error"]["value"] == pytest.approx(1 / factor - 1, abs=0.02)
    assert "at all joints alike" in done.sentences[0]
    assert done.model.parameter("fo") == pytest.approx(factor * OFFSET, abs=0.5)
