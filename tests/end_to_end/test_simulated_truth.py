"""The simulated arm, whose truth is known: what is said of OLS, and how well the fit predicts."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.checks.examine import examine
from ident.cli import main
from ident.effects.bound_effects import load_model
from ident.model.identified_model import Model
from ident.recordings.dataset import Segment, in_memory
from ident.recordings.loading import Reading, read_logs
from sim_bus.assembly import load_simulation
from wamctl.arm.config import find_file
from wamctl.arm.inertial import pseudo_inertia
from wamctl.arm.trajectory import FourierSeries, Trajectory, read_trajectory, write_trajectory

CONFIG = find_file("wam7.yaml")
WAMCTL = Path(sys.executable).with_name("wamctl")


def ident(*arguments: object) -> None:
    """An `ident` command, which has to succeed."""
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    assert not ended.value.code


def recorded(folder: Path, name: str, series: FourierSeries) -> Path:
    """One period of a motion, on the simulated arm."""
    trajectory, log = folder / f"{name}.yaml", folder / f"{name}.mcap"
    write_trajectory(trajectory, Trajectory(series, 1, {}, {}))
    words = ("--bus", "sim", "--lockstep", "--skip-test-motion", "wam7", "--trajectory", trajectory)
    excite = (WAMCTL, "excite", "--config", CONFIG, *words, "--out", log)
    subprocess.run(list(map(str, excite)), check=True, capture_output=True, timeout=300)
    return log


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the shipped motion, and a recording of the same motion backwards in time."""
    folder = tmp_path_factory.mktemp("truth")
    shipped = read_trajectory(find_file("wam7-excitation.yaml")).series
    ident("run", recorded(folder, "forwards", shipped), "--out", folder / "model")
    recorded(folder, "backwards", replace(shipped, a=-shipped.a))
    return folder


def true_model(found: Model) -> Model:
    """The identified arm's description with the simulated arm's own parameters."""
    truth = load_simulation(CONFIG, 0).truth
    assert not truth.rotor_inertia.any()
    own = {"fv": truth.viscous, "fc": truth.coulomb}
    links = iter(truth.delta)
    delta = [
        next(links) if p.kind == "inertial" else own[p.kind][p.index - 1] for p in found.parameters
    ]
    return replace(found, delta=np.array(delta), base_parameters=())


def held_out_percent(folder: Path, model: Path, out: str) -> float:
    ident("validate", folder / "backwards.mcap", "--model", model, "--out", folder / out)
    (log,) = json.loads((folder / out / "validate.json").read_text())["logs"]
    return log["relative_error_percent"]


def test_it_predicts_another_motion_nearly_as_well_as_the_truth(folder: Path) -> None:
    found = load_model(folder / "model" / "model.yaml")
    truth = folder / "truth.yaml"
    true_model(found).save(truth)
    of_truth = held_out_percent(folder, truth, "truth")
    assert 0.1 < of_truth < 2.0
    assert held_out_percent(folder, folder / "model" / "model.yaml", "found") <= 1.1 * of_truth


def test_what_it_says_of_feasibility_is_so(folder: Path) -> None:
    estimators = json.loads((folder / "model" / "run.json").read_text())["estimators"]
    ols, feasible = estimators["ols"], estimators["feasible"]
    assert feasible["feasible"]
    assert feasible["mass_matrix_positive_fraction"] == 1.0
    links = load_model(folder / "model" / "model.yaml").inertial.reshape(7, 10)
    assert min(np.linalg.eigvalsh(pseudo_inertia(link))[0] for link in links) > 0
    assert ols["feasible"] == (ols["min_pseudo_inertia_eigenvalue"] > 0)
    assert ols["mass_matrix_positive_fraction"] == 1.0 or not ols["feasible"]


def test_culling_lowers_the_error_and_its_controls_do_not(folder: Path) -> None:
    """Fig. 2 of the paper: the arm sticks near zero velocity, which the model does not hold."""
    found = json.loads((folder / "model" / "run.json").read_text())
    culling = found["culling"]
    at = culling["thresholds_rad_s"].index(0.01)

    def change(curve: str, what: str) -> float:
        return culling[curve][what][at] / culling[curve][what][0] - 1

    assert change("slow", "mse") < -0.15
    assert change("slow", "condition_number") < 0.05
    assert change("random", "mse") > -0.05
    assert change("other", "mse") > -0.05
    ols, feasible = (found["estimators"][name]["mse"] for name in ("ols", "feasible"))
    assert feasible < 1.1 * ols


@pytest.mark.parametrize(("start_s", "late_s"), [(4, 0.0), (7, 0.0), (7, 0.12)])
def test_joints_that_stick_are_not_late_and_late_ones_are(folder, start_s, late_s) -> None:
    """Eight seconds of the motion, in which torque changes before its joint slides again."""
    arm, (data,) = read_logs([folder / "forwards.mcap"], None, Reading())
    (whole,), rate = data.segments, round(data.rate_hz)
    rows = np.arange(start_s * rate, (start_s + 8) * rate) + data.spans[0].used[0]
    part = Segment(0.0, whole.q[rows], whole.tau[rows - round(late_s * rate)])
    remarks = examine(arm, [in_memory(data, data.rate_hz, [part])]).remarks
    assert any(r.code == "late_torque" for r in remarks) == (late_s > 0)
