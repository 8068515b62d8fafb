"""`wamctl` as its user meets it: processes, signals, exit codes, sentences."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from wamctl.arm.recording import read_recording

WAMCTL = str(Path(sys.executable).with_name("wamctl"))
SIM_BUS = str(Path(sys.executable).with_name("sim-bus"))


def run(*arguments, **options):
    return subprocess.run(
        [WAMCTL, *map(str, arguments)], capture_output=True, text=True, timeout=120, **options
    )


@pytest.fixture
def arm(configure, tmp_path, none_left):
    """A short experiment's file."""
    return configure(tmp_path)


@pytest.fixture
def long(configure, tmp_path, none_left):
    """An experiment that is still under way when a busy machine looks."""
    return configure(tmp_path, 60)


@pytest.fixture
def none_left():
    """At the end none of its processes may be left."""
    before = set(psutil.pids())
    yield
    deadline = time.monotonic() + 15
    while (left := left_over(before)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert left == []


def left_over(before):
    """Command lines of processes of this project that came since."""
    found = []
    for process in psutil.process_iter(["pid", "cmdline", "ppid"]):
        line = " ".join(process.info["cmdline"] or [])
        mine = "wamctl.telemetry" in line or "--stop-with-stdin" in line
        if process.info["pid"] not in before and mine and process.info["ppid"] == os.getpid():
            found.append(line)
    return found


def test_excite_prints_what_it_did(arm, tmp_path):
    done = run(
        "excite",
        "--config",
        arm,
        "--bus",
        "sim",
        "--lockstep",
        "--json",
        "--out",
        tmp_path / "log.mcap",
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["counted_cycles"] == 500
    assert result["frames"]["lost"] == 0
    assert result["log"] == str(tmp_path / "log.mcap")
    assert notes_apart(done.stderr).startswith("Next: ident run ")


def test_a_bus_that_is_not_there(arm):
    done = run("excite", "--config", arm, "--bus", "socketcan:nocan7")
    assert done.returncode == 4
    assert done.stderr.startswith("Bus socketcan:nocan7 cannot be opened (")
    assert done.stderr.endswith("`--bus sim` runs the simulated arm and needs no hardware.\n")
    assert done.stderr.count("\n") == 1


def test_an_arm_that_nobody_named_does_not_move(arm, tmp_path):
    done = run("excite", "--config", arm, "--bus", "can0", stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert "`--bus sim`" in done.stderr
    assert list(tmp_path.glob("*.mcap")) == []


def test_lockstep_is_refused_where_a_real_arm_may_be(arm):
    done = run("excite", "--config", arm, "--bus", "socketcan:can0", "--lockstep")
    assert (done.returncode, done.stderr) == (
        2,
        "--lockstep is for simulated arms: on bus socketcan:can0 a SYNC would follow the last one "
        "at once.\n",
    )


def test_hidden_effects_are_listed_without_an_arm():
    done = run("excite", "--hidden", "list")
    assert (done.returncode, done.stderr) == (0, "")
    lines = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert len(lines) >= 8
    assert lines["joint_spring"] == (
        "joint 3 (shoulder yaw): a cable harness that pulls with 1.2 N m/rad towards 0.3 rad"
    )


def test_a_hidden_effect_is_refused_where_a_real_arm_may_be(arm):
    done = run("excite", "--config", arm, "--bus", "socketcan:can0", "--hidden", "joint_spring")
    assert (done.returncode, done.stderr) == (
        2,
        "--hidden is for the embedded simulated arm: give --bus sim with it, not socketcan:can0; "
        "no drive was asked.\n",
    )


def test_an_unknown_hidden_effect_is_a_matter_of_usage(arm, tmp_path):
    log = tmp_path / "log.mcap"
    done = run("excite", "--config", arm, "--bus", "sim", "--hidden", "bakclash", "--out", log)
    assert done.returncode == 2
    assert notes_apart(done.stderr).startswith(
        "The simulated arm did not start: --hidden got 'bakclash', which is neither a file nor the "
        "name of a shipped effect. Did you mean backlash? Shipped: backlash, "
    )
    assert not log.exists()


def test_a_file_of_hidden_effects_that_the_arm_cannot_have(arm, tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("effects: [{effect: joint_spring, joints: [9], nm_rad: 1.0}]")
    done = run("excite", "--config", arm, "--bus", "sim", "--hidden", wrong)
    assert (done.returncode, notes_apart(done.stderr)) == (
        3,
        f"The simulated arm did not start: {wrong}: effects.0.joint_spring: joint 9 of an arm with "
        "7 joints.\n",
    )


@pytest.mark.thorough
def test_a_hidden_effect_is_in_the_motion_and_nowhere_else_in_the_log(arm, tmp_path):
    logs = tmp_path / "plain.mcap", tmp_path / "secret.mcap"
    plain = ("excite", "--config", arm, "--bus", "sim", "--lockstep", "--out")
    assert run(*plain, logs[0]).returncode == 0
    assert run(*plain, logs[1], "--hidden", "joint_spring").returncode == 0
    without, with_it = map(read_recording, logs)
    assert with_it.attachments == without.attachments
    pulled = abs((with_it.command.effort - without.command.effort).mean(axis=0))
    assert pulled[2] > 0.2
    assert pulled[[0, 1, 3, 4, 5, 6]].max() < 0.1  # noise averages out


def notes_apart(stderr):
    """What was said beside the note on a first compilation."""
    return "".join(line for line in stderr.splitlines(True) if not line.startswith("note: "))


def test_check_asks_the_drives(arm, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # nothing is compiled yet
    done = run("check", "--config", arm, "--bus", "sim", "--json")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("note: the simulated arm is being compiled, which happens once ")
    found = json.loads(done.stdout)
    assert found["drives"] == [f"drive {k} (node {k})" for k in range(1, 8)]
    assert 0.5 < found["load"]["worst"] < 0.6


def test_home_gives_the_line_for_the_configuration(arm):
    done = run("home", "--config", arm, "--bus", "sim", input="\n")
    assert done.returncode == 0
    assert done.stdout.strip() == (
        "write into the section `drives` of the arm's file: "
        "zero_counts: [0, 18416, -18416, 7041, 0, 0, 0]"
    )


def test_a_killed_writer_stops_the_arm(long, tmp_path):
    log = tmp_path / "log.mcap"
    with started(long, log) as process:
        wait_for_rows(log, process)
        writer_of(process).kill()
        _, said = process.communicate(timeout=60)
    assert process.returncode == 5
    assert f"the process that writes the log {log} ended with status -9, " in said
    assert len(read_recording(log).q) > 0


def test_a_full_disk_stops_the_arm(long, tmp_path):
    log = tmp_path / "log.mcap"
    with started(long, log) as process:
        wait_for_rows(log, process)
        writer_of(process).rlimit(psutil.RLIMIT_FSIZE, (150_000, 150_000))
        _, said = process.communicate(timeout=60)
    assert process.returncode == 5
    assert f"the process that writes the log {log} cannot write any more (" in said
    assert "(File too large)), " in said
    assert len(read_recording(log).q) > 0


def test_a_killed_loop_leaves_a_log_and_drives_that_stop_by_themselves(long, tmp_path):
    log, socket = tmp_path / "log.mcap", tmp_path / "bus"
    command = [SIM_BUS, "serve", "--config", str(long), "--bus", f"simbus:{socket}", "--lockstep"]
    with subprocess.Popen(
        [*command, "--stop-with-stdin"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as server:
        server.stdout.readline()
        with started(long, log, bus=f"simbus:{socket}") as process:
            wait_for_rows(log, process)
            process.kill()
            process.communicate(timeout=60)
        wait_until_closed(log)
        server.stdin.close()
        server.stdout.close()
    assert len(read_recording(log).q) > 100


def writer_of(process):
    children = psutil.Process(process.pid).children()
    return next(c for c in children if "wamctl.telemetry.writer" in c.cmdline())


def started(arm, log, bus="sim", **options):
    command = [WAMCTL, "excite", "--config", arm, "--bus", bus, "--lockstep", "--out", log]
    command += ["--skip-test-motion", "wam7"]  # in it nothing is braked
    return subprocess.Popen(
        list(map(str, command)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def wait_for_rows(log, process):
    deadline = time.monotonic() + 60
    while not (log.exists() and log.stat().st_size > 60_000):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.005)


def wait_until_closed(log):
    """The writer notices that the loop has died, and ends the log."""
    deadline = time.monotonic() + 30
    while not read_recording(log).complete:
        assert time.monotonic() < deadline
        time.sleep(0.1)
