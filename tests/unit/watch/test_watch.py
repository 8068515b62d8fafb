"""`ident watch`: silence where nothing has changed, and a name where something has."""

import json
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from ident.cli import main
from ident.recordings.loading import Reading
from ident.watch.residual import CausalFilter
from ident.workflows.fleet.watch import watched
from ident.workflows.run import run_logs
from tests.unit.fleet.conftest import ordinary, write_log


def watch(*arguments: object) -> int:
    """Exit status of `ident watch`, in this process."""
    with pytest.raises(SystemExit) as ended:
        main(["watch", *map(str, arguments)])
    return int(ended.value.code or 0)


@pytest.fixture(scope="module")
def arm():
    return ordinary(np.random.default_rng(0))


@pytest.fixture(scope="module")
def model(arm, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trusted")
    write_log(folder / "fit.mcap", arm, 0, np.random.default_rng(1), seconds=90.0)
    run_logs([folder / "fit.mcap"], None, folder / "model", Reading())
    return folder / "model" / "model.yaml"


@pytest.fixture
def log(tmp_path):
    def made(arm, seed=2, seconds=40.0):
        path = tmp_path / f"{seed}.mcap"
        write_log(path, arm, 0, np.random.default_rng(seed), seconds=seconds)
        return path

    return made


def test_nothing_is_told_of_an_arm_that_is_as_its_model_says(arm, model, log):
    for seed in (2, 3, 4):
        *alarms, end = watched(str(log(arm, seed)), model, Reading(), 0.0)
        assert alarms == []
        assert end["motion_s"] > 25.0


def test_a_load_is_told_with_its_mass_and_centre_within_seconds(arm, model, log, tmp_path):
    page, loaded = tmp_path / "watch.html", str(log(replace(arm, load=0.5)))
    first, *_ = watched(loaded, model, Reading(), 0.0, report=page)
    assert f"Since {first['since']} the trusted model" in page.read_text(encoding="utf-8")
    assert first["kind"] == "payload"
    mass = first["parameters"]["mass"]
    assert mass["value"] == pytest.approx(0.5, rel=0.05)
    assert first["centre_m"][2] == pytest.approx(-0.3, abs=0.03)
    assert first["told_ns"] - first["since_ns"] < 5e9


def test_friction_is_told_with_its_joint(arm, model, log):
    stiff = replace(arm, fc=arm.fc * np.array([1.0, 1.8]))
    first, *_ = watched(str(log(stiff)), model, Reading(), 0.0)
    assert (first["kind"], first["joints"]) == ("friction", [2])
    assert first["parameters"]["fc2"]["value"] == pytest.approx(0.8 * arm.fc[1], rel=0.25)


def test_a_log_is_followed_while_it_is_written(arm, model, log, tmp_path):
    whole = log(replace(arm, load=0.5)).read_bytes()
    growing = tmp_path / "growing.mcap"
    growing.write_bytes(whole[: len(whole) // 3])

    def grow():
        time.sleep(0.5)
        with growing.open("ab") as file:
            file.write(whole[len(whole) // 3 :])

    writer = threading.Thread(target=grow)
    writer.start()
    *alarms, end = watched(str(growing), model, Reading(), 30.0)
    writer.join()
    assert alarms[0]["kind"] == "payload"
    assert end["motion_s"] > 25.0


def test_lines_of_json_and_an_exit_code_from_standard_input(arm, model, log):
    command = [sys.executable, "-m", "ident.cli", "watch", "-", "--model", str(model), "--json"]
    with log(replace(arm, load=0.5), 5).open("rb") as file:
        done = subprocess.run(command, stdin=file, capture_output=True, text=True, check=False)
    assert done.returncode == 6
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert lines[0]["kind"] == "payload"
    assert lines[-1]["kind"] == "end"
    assert watch(log(arm, 6), "--model", model, "--idle", 0) == 0


def test_what_cannot_be_watched_is_told_in_a_sentence(model, tmp_path, capsys):
    shutil.copy(model, tmp_path / "no.mcap")
    for source, words in (
        (str(tmp_path / "gone.mcap"), "cannot be read"),
        (str(tmp_path / "no.mcap"), "is no MCAP log"),
        ("ws://127.0.0.1:9", "does not answer"),
    ):
        assert watch(source, "--model", model, "--idle", 0) == 6
        assert words in capsys.readouterr().err


def test_the_filter_gives_the_derivatives_of_one_instant():
    """A ramp's rate is its slope and its acceleration nothing, however coarse the samples."""
    q, qd, qdd = CausalFilter(8.0, 0.004)(0.7 * np.arange(1000)[:, None] * 0.004, 2)
    np.testing.assert_allclose(qd[500:], 0.7, rtol=1e-8)
    np.testing.assert_allclose(qdd[500:], 0.0, atol=1e-7)
    t = 0.004 * np.arange(4000)
    wave = 2 * np.pi * 1.0
    q, qd, qdd = CausalFilter(8.0, 0.004)(np.sin(wave * t)[:, None], 2)
    np.testing.assert_allclose(qdd[2000:], -(wave**2) * q[2000:], atol=2e-3 * wave**2)
