"""Efforts that are currents: gains from links that joints share and from the URDF's weight."""

import json

import numpy as np
import pytest
from chain_arm import Experiment, urdf_of

import ident
from ident.checks.examine import examine
from ident.cli import main
from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.options import Options
from ident.identification.validation import arm_of, predict
from ident.workflows.gap import gap_of
from ident.workflows.run import run_data
from ident.workflows.validate import checked
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.recorder import Recorder

LOAD = """
  <joint name="hook" type="fixed"><parent link="link_4"/><child link="load"/>
    <origin xyz="0.1 0 0.2"/></joint>
  <link name="load"><inertial><mass value="2"/>
    <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>"""

GAINS = np.array([11.0, 14.0, 7.0, 9.0])


def of_currents(log, **settings):
    arm = log.arm().with_settings(torque_unit="A", **settings)
    return run_data(arm, [log.dataset(arm)])


def in_ampere(joints: int = 4, **settings):
    log = Experiment(joints=joints, seconds=20.0, **settings).log()
    return log.with_(tau=log.tau / GAINS[:joints])


@pytest.mark.parametrize(
    "seed",
    [0, pytest.param(1, marks=pytest.mark.thorough), pytest.param(2, marks=pytest.mark.thorough)],
)
def test_gains_are_found_within_their_intervals(seed):
    done = of_currents(in_ampere(seed=seed))
    for told, gain in zip(done.content["gains"], GAINS, strict=True):
        assert told["sd"] is not None
        assert abs(told["nm_per_ampere"] - gain) < 3 * told["sd"]
        assert told["sd"] < 0.05 * gain
    assert done.content["remarks"][0]["code"] == "current_not_torque"
    assert "N m/A" in done.content["remarks"][0]["sentence"]


def test_parameters_in_newton_metres_are_those_of_the_torque():
    log = Experiment(joints=4, seconds=20.0).log()
    right = run_data(log.arm(), [log.dataset(log.arm())])
    done = of_currents(log.with_(tau=log.tau / GAINS))
    rows = zip(done.content["base_parameters"], right.content["base_parameters"], strict=True)
    off = [(a["ols"] - b["ols"]) / a["sd"] for a, b in rows]
    assert np.abs(off).max() < 3.0


@pytest.mark.thorough
def test_parameters_in_ampere_do_not_depend_on_the_masses_of_the_urdf():
    """Half the masses in the URDF: half the gains, and the same friction in ampere."""
    log = in_ampere()
    half = log.with_(urdf=urdf_of(4, 2.5 * 0.7 ** np.arange(4)))
    first, second = (of_currents(x).content for x in (log, half))
    for a, b in zip(first["gains"], second["gains"], strict=True):
        assert b["nm_per_ampere"] == pytest.approx(0.5 * a["nm_per_ampere"], rel=0.1)
    for a, b in zip(first["base_parameters"], second["base_parameters"], strict=True):
        assert abs(a["ols_ampere"] - b["ols_ampere"]) < 0.2 * a["sd_ampere"]


def test_one_factor_of_all_joints_is_not_said_where_a_light_joint_has_another():
    log = Experiment(joints=6, seconds=20.0).log()
    data = log.with_(tau=log.tau * np.array([1.6, 1.6, 1.6, 1.6, 1.6, 10.0])).dataset(log.arm())
    (remark,) = examine(log.arm(), [data]).remarks
    assert remark.code == "current_not_torque"
    assert "joint 6 is 9.99 ±" in remark.sentence
    assert "joints 1 to 5 1.6 times" in remark.sentence


def test_without_masses_one_factor_stays_open():
    log = in_ampere()
    done = of_currents(log.with_(urdf=urdf_of(4, np.zeros(4))))
    codes = {r["code"]: r["sentence"] for r in done.content["remarks"]}
    assert "one common factor" in codes["current_not_torque"]
    assert done.content["verdict"] == "doubtful"
    gains = np.array([g["nm_per_ampere"] for g in done.content["gains"]])
    np.testing.assert_allclose(gains / gains[1], GAINS / GAINS[1], rtol=0.05)


def lone(axis: str, masses=None):
    """A recording of one joint about an axis, in ampere; its URDF with other masses, perhaps."""
    urdf, told = (
        urdf_of(1, m).replace('<axis xyz="0 0 1"', f'<axis xyz="{axis}"') for m in (None, masses)
    )
    log = Experiment(joints=1, seconds=20.0, true_urdf=urdf).log()
    return log.with_(tau=log.tau / 11.0, urdf=told)


def test_a_lone_joint_has_its_gain_from_the_masses_of_the_urdf_alone():
    (told,) = of_currents(lone("0 1 0")).content["gains"]
    assert told["from"] == "weight"
    assert abs(told["nm_per_ampere"] - 11.0) < 3 * told["sd"]


@pytest.mark.parametrize("currents", [lone("0 1 0", np.zeros(1)), lone("0 0 1")])
def test_neither_links_without_mass_nor_inertia_alone_tell_a_gain(currents):
    """A rotor, of which the URDF says nothing, takes current as an inertia does."""
    done = of_currents(currents)
    assert done.content["gains"][0] | {"nm_per_ampere": 0} == {
        "joint": 1, "nm_per_ampere": 0, "sd": None, "from": "none",
    }  # fmt: skip
    assert done.content["verdict"] == "doubtful"


@pytest.mark.thorough
def test_rotors_do_not_change_the_gains_that_weight_tells():
    log = Experiment(joints=4, seconds=20.0).log()
    qdd = np.gradient(np.gradient(log.q, axis=0), axis=0) / np.median(np.diff(log.t)) ** 2
    gains = of_currents(log.with_(tau=(log.tau + [1.0, 0.5, 0.2, 0.1] * qdd) / GAINS)).content
    for told, gain in zip(gains["gains"], GAINS, strict=True):
        if told["from"] == "weight":
            assert abs(told["nm_per_ampere"] - gain) < 3 * told["sd"]


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


def with_load(seed: int):
    """Recordings without and with 2 kg at (0.1, 0, 0.2) m of the last link, and a wrong URDF."""
    half = urdf_of(4, 2.5 * 0.7 ** np.arange(4))
    hung = urdf_of(4).replace("</link></robot>", f"</link>{LOAD}</robot>")
    loaded = in_ampere(seed=seed + 10, true_urdf=hung)
    return in_ampere(seed=seed).with_(urdf=half), loaded.with_(urdf=half)


def test_a_known_load_tells_the_gains_where_masses_are_wrong(tmp_path):
    empty, loaded = with_load(seed=0)
    (tmp_path / "arm.urdf").write_text(empty.urdf)
    arm = ident.Arm.from_urdf(tmp_path / "arm.urdf", torque_unit="A")
    one, other = (ident.Recording(x.t, x.q, x.tau, x.names) for x in (empty, loaded))
    done = ident.identify(arm, one, load=(other, (2.0, 0.1, 0.0, 0.2)))
    for told, gain in zip(done.content["gains"], GAINS, strict=True):
        assert abs(told["nm_per_ampere"] - gain) < 3 * told["sd"]
        assert told["sd"] < 0.05 * gain
    assert "by the known load" in done.content["remarks"][0]["sentence"]


def test_the_command_takes_a_known_load_for_currents_alone(tmp_path, capsys):
    for name, one in zip(("empty", "loaded"), with_load(seed=1), strict=True):
        inside = {"robot.urdf": one.urdf.encode()}
        with Recorder(tmp_path / f"{name}.mcap", one.names, {}, inside) as log:
            for t, q, tau in zip(one.t, one.q, one.tau, strict=True):
                log.joint_states(round(t * 1e9), q, None, tau)
    load = ["--load", f"{tmp_path / 'loaded.mcap'}=2,0.1,0,0.2", "--out", str(tmp_path / "out")]
    codes = []
    for more in ([], ["--set", "torque_unit=A"]):
        with pytest.raises(SystemExit) as ended:
            main(["run", str(tmp_path / "empty.mcap"), *load, *more])
        codes.append(ended.value.code or 0)
    assert codes == [3, 0]
    assert "a known load tells gains of currents alone" in capsys.readouterr().err
    gains = json.loads((tmp_path / "out" / "run.json").read_text())["gains"]
    for told, gain in zip(gains, GAINS, strict=True):
        assert told["from"] in ("load", "links")
        assert told["nm_per_ampere"] == pytest.approx(gain, rel=0.05)


def test_the_search_takes_currents_by_a_setting(tmp_path):
    arm, out = in_ampere(), tmp_path / "out"
    with Recorder(tmp_path / "a.mcap", arm.names, {}, {"robot.urdf": arm.urdf.encode()}) as log:
        for t, q, tau in zip(arm.t, arm.q, arm.tau, strict=True):
            log.joint_states(round(t * 1e9), q, None, tau)
    options = ["--set", "torque_unit=A", "--null-runs", "0", "--out", str(out)]
    with pytest.raises(SystemExit) as ended:
        main(["gap", str(tmp_path / "a.mcap"), *options])
    assert not ended.value.code
    gains = ident.load_model(out / "model.yaml").gains_nm_per_a
    assert gains == pytest.approx(GAINS, rel=0.02)


@pytest.mark.parametrize("settings", [{"torque_unit": "A"}, {}])
def test_a_reference_model_tells_what_a_load_weighs_by_its_own_gains(settings):
    """By gains weighed anew against the URDF, the load was taken for stronger drives."""
    hung = urdf_of(4).replace("</link></robot>", f"</link>{LOAD}</robot>")
    empty, loaded = in_ampere(), in_ampere(seed=10, true_urdf=hung)
    known = of_currents(empty).model
    source = of_arm(empty.arm().with_settings(**settings), None, [loaded.recording()], ["loaded"])
    beside = with_reference_model(source, known)
    done = gap_of(beside, Options(null_runs=0), lambda *told: None)
    (effect,) = done.content["effects"]
    assert effect["name"] == "payload"
    assert effect["parameters"]["mass"]["value"] == pytest.approx(2.0, rel=0.05)
    assert done.model.gains_nm_per_a == known.gains_nm_per_a
    (told,) = done.content["errors"]
    arm = arm_of(done.model)
    (data,), _ = checked(arm, [loaded.dataset(arm)])
    again = predict(done.model, arm, data).filtered["feasible"]
    assert told["relative_error_percent"] == pytest.approx(again.relative_percent, rel=0.01)


def test_an_arm_that_says_what_its_efforts_are_is_asked_no_model():
    empty = in_ampere()
    known, log = of_currents(empty).model, empty.recording()
    for said in ({"torque_unit": "N m"}, {"torque_unit": "A", "gains_nm_per_a": GAINS.tolist()}):
        arm = empty.arm().with_settings(**said)
        source = with_reference_model(of_arm(arm, None, [log], ["log"]), known)
        assert source.arm.settings == arm.settings
