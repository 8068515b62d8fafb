"""Efforts that are currents: gains from links that joints share and from the URDF's weight."""

import numpy as np
import pytest
from chain_arm import recorded, urdf_of

from ident.identification.validation import arm_of
from ident.workflows.run import run_data
from ident.workflows.validate import checked
from wamctl.arm.errors import ConfigurationError

GAINS = np.array([11.0, 14.0, 7.0, 9.0])


def of_currents(log, **settings):
    arm = log.arm().with_settings(torque_unit="A", **settings)
    return run_data(arm, [log.dataset(arm)])


def in_ampere(joints: int = 4, **settings):
    log = recorded(joints=joints, seconds=20.0, **settings)
    return log.with_(tau=log.tau / GAINS[:joints])


@pytest.mark.parametrize("seed", range(3))
def test_gains_are_found_within_their_intervals(seed):
    done = of_currents(in_ampere(seed=seed))
    for told, gain in zip(done.content["gains"], GAINS, strict=True):
        assert told["sd"] is not None
        assert abs(told["nm_per_ampere"] - gain) < 3 * told["sd"]
        assert told["sd"] < 0.05 * gain
    assert done.content["remarks"][0]["code"] == "current_not_torque"
    assert "N m/A" in done.content["remarks"][0]["sentence"]


def test_parameters_in_newton_metres_are_those_of_the_torque():
    log = recorded(joints=4, seconds=20.0)
    right = run_data(log.arm(), [log.dataset(log.arm())])
    done = of_currents(log.with_(tau=log.tau / GAINS))
    rows = zip(done.content["base_parameters"], right.content["base_parameters"], strict=True)
    off = [(a["ols"] - b["ols"]) / a["sd"] for a, b in rows]
    assert np.abs(off).max() < 3.0


def test_parameters_in_ampere_do_not_depend_on_the_masses_of_the_urdf():
    """Half the masses in the URDF: half the gains, and the same friction in ampere."""
    log = in_ampere()
    half = log.with_(urdf=urdf_of(4, 2.5 * 0.7 ** np.arange(4)))
    first, second = (of_currents(x).content for x in (log, half))
    for a, b in zip(first["gains"], second["gains"], strict=True):
        assert b["nm_per_ampere"] == pytest.approx(0.5 * a["nm_per_ampere"], rel=0.1)
    for a, b in zip(first["base_parameters"], second["base_parameters"], strict=True):
        assert abs(a["ols_ampere"] - b["ols_ampere"]) < 0.2 * a["sd_ampere"]


def test_without_masses_one_factor_stays_open():
    log = in_ampere()
    done = of_currents(log.with_(urdf=urdf_of(4, np.zeros(4))))
    codes = {r["code"]: r["sentence"] for r in done.content["remarks"]}
    assert "one common factor" in codes["current_not_torque"]
    assert done.content["verdict"] == "doubtful"
    gains = np.array([g["nm_per_ampere"] for g in done.content["gains"]])
    np.testing.assert_allclose(gains / gains[1], GAINS / GAINS[1], rtol=0.05)


def test_a_lone_joint_has_its_gain_from_the_masses_of_the_urdf_alone():
    log = recorded(joints=1, seconds=20.0)
    currents = log.with_(tau=log.tau / 11.0)
    (told,) = of_currents(currents).content["gains"]
    assert told["from"] == "weight"
    assert abs(told["nm_per_ampere"] - 11.0) < 3 * told["sd"]
    done = of_currents(currents.with_(urdf=urdf_of(1, np.zeros(1))))
    assert done.content["gains"][0] | {"nm_per_ampere": 0} == {
        "joint": 1, "nm_per_ampere": 0, "sd": None, "from": "none",
    }  # fmt: skip
    assert done.content["verdict"] == "doubtful"


def test_given_gains_are_taken_and_a_model_predicts_currents():
    log = in_ampere()
    done = of_currents(log, gains_nm_per_a=GAINS.tolist())
    assert done.content["remarks"] == []
    assert [g["from"] for g in done.content["gains"]] == ["given"] * 4
    arm = arm_of(done.model)
    (data,), remarks = checked(arm, [log.dataset(arm)])
    assert remarks == []
    tau = np.concatenate([part.tau for _, part in data.read()])
    np.testing.assert_allclose(tau, log.tau * GAINS, rtol=1e-9)


def test_gains_for_another_number_of_joints_are_refused():
    with pytest.raises(ConfigurationError, match="2 gains for 4 joints"):
        of_currents(in_ampere(), gains_nm_per_a=[1.0, 2.0])
