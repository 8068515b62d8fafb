"""The Python interface, as a stranger's script would use it."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info

import ident
from ident.gap.data.experiment import of_arm
from ident.identification.validation import arm_of
from ident.workflows.model_errors import errors_on
from wamctl.arm.config import find_file
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.robot import inverse_dynamics, load_robot
from wamctl.arm.trajectory import read_trajectory, sample

COULOMB = np.array([1.5, 1.2, 0.8, 0.9, 0.2, 0.2, 0.05])


@pytest.fixture(scope="module")
def arrays() -> dict:
    """One period of the shipped motion with CAD torque, Coulomb friction and a little noise."""
    series = read_trajectory(find_file("wam7-excitation.yaml")).series
    robot = load_robot(find_file("wam7.urdf").read_text())
    t = np.arange(0, series.period_s, 0.005)
    q, qd, qdd = sample(series, t)
    noise = np.random.default_rng(5).normal(0, 0.02, q.shape)
    tau = inverse_dynamics(robot, q, qd, qdd) + COULOMB * np.sign(qd) + noise
    return {"t": t, "q": q, "tau": tau, "joints": series.joint_names}


@pytest.fixture(scope="module")
def arm() -> ident.Arm:
    return ident.Arm.from_config("wam7.yaml")


@pytest.fixture(scope="module")
def fit(arm, arrays) -> ident.Identified:
    return ident.identify(arm, ident.Recording(**arrays))


def test_identification_from_arrays(fit, arrays, tmp_path) -> None:
    assert fit.verify(max_error=5) is fit
    np.testing.assert_allclose(fit.model.parameter("fc"), COULOMB, rtol=0.05, atol=0.01)
    assert fit.score(ident.Recording(**arrays)).relative_error_percent < 2
    assert "verdict" in fit.report(tmp_path / "report.html").read_text().lower()
    fit.save(tmp_path / "saved")
    assert ident.load_model(tmp_path / "saved" / "model.yaml").arm == fit.model.arm
    assert len(fit.table()) == 57
    assert "<table>" in fit._repr_html_()


def test_one_error_of_one_model_on_one_log(fit, arrays) -> None:
    """The same from `run`, from `validate`, and from `gap` beside the model."""
    recording = ident.Recording(**arrays)
    of_run = fit.content["estimators"]["feasible"]
    source = of_arm(arm_of(fit.model), None, [recording.log], [recording.name])
    (of_gap,) = errors_on(fit.model, source.datasets)
    assert of_gap["cutoff_hz"] == fit.content["cutoff_hz"]
    for key in ("relative_error_percent", "mse"):
        assert of_gap[key] == pytest.approx(of_run[key], rel=1e-9)
    score = fit.score(recording)
    assert score.relative_error_percent == pytest.approx(of_run["relative_error_percent"], rel=1e-9)
    np.testing.assert_allclose(
        score.relative_error_percent_by_joint,
        of_run["relative_error_percent_by_joint"],
        rtol=1e-9,
    )


def test_a_script_needs_no_thread_limit_of_its_own(arm, arrays) -> None:
    threads, steps = set(), []

    def look(step: str, share: float | None) -> None:
        steps.append(step)
        threads.update(pool["num_threads"] for pool in threadpool_info())

    before = [pool["num_threads"] for pool in threadpool_info()]
    ident.identify(arm, ident.Recording(**arrays), progress=look)
    assert threads == {1}
    assert steps[0] == "checking the recordings"
    assert [pool["num_threads"] for pool in threadpool_info()] == before


def test_a_model_predicts_a_recording_of_python(fit, arrays) -> None:
    assert fit.model.predict(ident.Recording(**arrays)).shape == arrays["q"].shape


def test_joints_of_another_prefix_are_the_arms(arm, fit, arrays) -> None:
    """As on the command line: what leaves no doubt is no reason to ask."""
    names = [f"left_{name}" for name in arrays["joints"]]
    other = ident.Recording(**arrays | {"joints": names})
    errors = [fit.score(one).relative_error_percent for one in (other, ident.Recording(**arrays))]
    assert errors[0] == errors[1]
    again = ident.identify(arm, other)
    assert again.model.robot.joint_names == fit.model.robot.joint_names
    assert again.error_percent == fit.error_percent


def test_a_copy_of_a_bag_with_other_arrays_is_what_its_arrays_say(arrays) -> None:
    """A script mends what was read and hands that on: what the file holds must not come back."""
    bag = ident.Recording(**arrays).log
    q, tau = arrays["q"], arrays["tau"]
    seconds = (bag.stamp_ns - bag.stamp_ns[0]) / 1e9
    read = ident.Recording(seconds, q, tau, bag.joint_names, bag=bag)
    assert read.log is bag
    assert replace(read, name="the same").log is bag
    np.testing.assert_array_equal(replace(read, q=-q).log.q, -q)
    np.testing.assert_array_equal(replace(read, tau=2 * tau).log.effort, 2 * tau)
    assert replace(read, q_command=q).log.command is not None


def test_a_urdf_is_enough(arrays) -> None:
    arm = ident.Arm.from_urdf(find_file("wam7.urdf"))
    fit = ident.identify(arm, [ident.Recording(**arrays)], cutoff_hz=8)
    assert fit.content["cutoff_hz"] == 8
    assert fit.score(ident.Recording(**arrays)).relative_error_percent < 2


def test_a_sweep_in_parallel(arm, arrays) -> None:
    recording = ident.Recording(**arrays)

    def error(cutoff_hz: float) -> float:
        return ident.identify(arm, recording, cutoff_hz=cutoff_hz).error_percent

    with ThreadPoolExecutor(2) as pool:
        errors = list(pool.map(error, [3.0, 6.0]))
    assert all(0 < e < 5 for e in errors)


def test_progress_is_told(arm, arrays) -> None:
    heard: list[str] = []
    ident.identify(arm, ident.Recording(**arrays), progress=lambda step, share: heard.append(step))
    assert len(set(heard)) >= 2


def test_a_model_that_misses_the_mark_is_not_verified(fit) -> None:
    with pytest.raises(DataError, match=r"held-out error is .* more than the 1e-05 %"):
        fit.verify(max_error=1e-5)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"tau": np.zeros((3, 7))}, "tau has the shape (3, 7); wanted is"),
        ({"q": np.zeros(7)}, "q has the shape (7,); wanted is"),
        ({"t": np.zeros((2, 2))}, "t has the shape (2, 2)"),
        ({"joints": "j1"}, "joints must be a list of different names"),
        ({"joints": ("a",) * 7}, "joints must be a list of different names"),
        ({"q": "abc"}, "q is not an array of numbers"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(arrays, change, sentence) -> None:
    with pytest.raises(DataError) as caught:
        ident.Recording(**{**arrays, **change})
    assert sentence in str(caught.value)


def test_a_number_that_is_none_is_refused(arrays) -> None:
    q = arrays["q"].copy()
    q[17, 2] = np.nan
    with pytest.raises(DataError, match="q is not a finite number in sample 17"):
        ident.Recording(**{**arrays, "q": q})


@pytest.mark.parametrize("value", [1e6, -1e154, 1e300])
@pytest.mark.parametrize(("key", "most"), [("q", "100000 rad or m"), ("tau", "1e+09 N m or N")])
def test_a_number_beyond_all_measure_is_refused(arrays, value, key, most) -> None:
    wrong = arrays[key].copy()
    wrong[17, 2] = value * (1e9 if key == "tau" and abs(value) < 1e9 else 1.0)
    with pytest.raises(DataError) as caught:
        ident.Recording(**{**arrays, key: wrong})
    assert f"recording: {key} of {arrays['joints'][2]} is {wrong[17, 2]:.3g} in sample 17" in str(
        caught.value
    )
    assert f"beyond {most}" in str(caught.value)


def test_time_that_runs_backwards_is_refused(arrays) -> None:
    t = arrays["t"].copy()
    t[10] = 0.0
    with pytest.raises(DataError, match=r"t runs backwards, from 0\.045000 s to 0\.000000 s"):
        ident.Recording(**{**arrays, "t": t})


def test_joints_of_another_arm_are_refused(arrays) -> None:
    arm = ident.Arm.from_urdf(find_file("wam7.urdf"))
    names = tuple(f"other_{k}" for k in range(7))
    with pytest.raises(DataError, match="are not those of"):
        ident.identify(arm, ident.Recording(**{**arrays, "joints": names}))


def test_an_unknown_setting_is_refused(arm, arrays) -> None:
    with pytest.raises(ConfigurationError, match="did you mean cutoff_hz"):
        ident.identify(arm, ident.Recording(**arrays), cutof_hz=8)


@pytest.mark.parametrize("call", [ident.identify, ident.find_gap])
def test_paths_in_place_of_arm_and_recording_are_told(call, arm, arrays) -> None:
    with pytest.raises(
        DataError, match=r"'log.mcap' is not an ident.Recording; Recording.from_bag"
    ):
        call(arm, "log.mcap")
    with pytest.raises(DataError, match=r"arm is 'arm.urdf', not an ident.Arm; Arm.from_urdf"):
        call("arm.urdf", ident.Recording(**arrays))
    with pytest.raises(DataError, match="No recording was given"):
        call(arm, [])


def test_a_score_asks_for_a_recording(fit) -> None:
    with pytest.raises(DataError, match=r"'other.mcap' is not an ident.Recording"):
        fit.score("other.mcap")
    for asked in (lambda m: ident.simulate(m), lambda m: ident.export_model(m, "arm.urdf")):
        with pytest.raises(DataError, match=r"model is 'model.yaml', not an ident.Model; ident.lo"):
            asked("model.yaml")
    with pytest.raises(DataError, match=r"array\(.*is not an ident.Recording"):
        fit.score(np.zeros((100, 7)))


def test_another_method_is_refused(arm, arrays) -> None:
    with pytest.raises(ConfigurationError, match=r"neither .*; did you mean simulation\?"):
        ident.identify(arm, ident.Recording(**arrays), method="simulate")
    with pytest.raises(ConfigurationError, match="-1 is less than none"):
        ident.find_gap(arm, ident.Recording(**arrays), null_runs=-1)


def test_what_cannot_be_written_is_told(fit, tmp_path) -> None:
    for write in (fit.model.save, fit.report):
        with pytest.raises(DataError, match="nowhere/file cannot be written"):
            write(tmp_path / "nowhere" / "file")


def test_results_print_in_a_line(fit, arrays) -> None:
    assert repr(ident.Recording(**arrays)) == (
        "<Recording recording: t, q, tau; 7 joints, 4000 samples>"
    )
    assert repr(fit.model) == "<Model wam7: 7 joints, feasible>"
    assert repr(fit).startswith("<Identified: wam7: trustworthy, held-out error ")


def test_a_joint_that_the_urdf_lacks_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="has no joint elbow"):
        ident.Arm.from_urdf(find_file("wam7.urdf"), joints=["elbow"])


@pytest.mark.parametrize("name", ident.__all__)
def test_every_public_name_is_there(name) -> None:
    assert getattr(ident, name) is not None


def test_the_version_is_that_of_the_package() -> None:
    assert ident.__version__.count(".") >= 1
    assert "identify" in dir(ident)


def test_a_script_without_a_main_guard(tmp_path) -> None:
    """Processes that the library starts must not run the user's script again."""
    script = tmp_path / "script.py"
    script.write_text(
        "import math\n"
        "from ident.regression.processes import in_processes\n"
        "print('once')\n"
        "print(list(in_processes(math.sqrt, [4.0, 9.0], 2)))\n"
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, check=True, cwd=Path(tmp_path)
    )
    assert done.stdout == "once\n[2.0, 3.0]\n"


def test_a_design_of_no_arm_is_refused() -> None:
    with pytest.raises(DataError, match=r"arm is 'wam7\.yaml', not an ident\.Arm; Arm\.from_urdf"):
        ident.design("wam7.yaml")  # pyright: ignore[reportArgumentType]
