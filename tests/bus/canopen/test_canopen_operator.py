"""Every key and every signal, as the operator gives them, while the arm moves and before."""

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from wamctl.arm.recording import read_recording
from wamctl.experiment.operator_stop import StopRequest

WAMCTL = str(Path(sys.executable).with_name("wamctl"))
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGRTMIN", "SIGABRT")
OF_A_WHOLE_RUN = ("SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP", "q", "ctrl-z")
"""With these a whole experiment is stopped; the others end in the same request to stop."""
MORE_THAN_ENOUGH = (
    60  # seconds of motion, of which a stop after a few is seen on a busy machine too
)
KEYS = {
    "q": b"q",
    "ctrl-c": b"\x03",
    "ctrl-z": b"\x1a",
    "ctrl-backslash": b"\x1c",
    "ctrl-s": b"\x13",
}


def started(configure, folder, **options):
    config, log = configure(folder, MORE_THAN_ENOUGH), folder / "log.mcap"
    words = [WAMCTL, "excite", "--config", config, "--bus", "sim", "--lockstep", "--out", log]
    words += ["--skip-test-motion", "wam7"]  # in it nothing is braked
    options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, **options}
    return subprocess.Popen(list(map(str, words)), start_new_session=True, **options), log


def wait_for_rows(log, process):
    deadline = time.monotonic() + 120
    while not (log.exists() and log.stat().st_size > 60_000):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.005)


def notes_apart(said):
    """What was said beside the note on a first compilation."""
    return "".join(line for line in said.splitlines(True) if not line.startswith("note: "))


def ended(process, log, said, cause):
    assert process.returncode == 5
    assert notes_apart(said).startswith(f"{cause}, ")
    assert "the arm was braked for 0.08 s with" in said
    assert f"the log {log} holds {len(read_recording(log).q)} cycles." in said
    assert read_recording(log).complete


@pytest.fixture
def asked(monkeypatch):
    """A request to stop that listens to a terminal, and the terminal's other end."""
    master, terminal = pty.openpty()
    with os.fdopen(terminal) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with StopRequest().listening() as asked:
            assert asked() is None
            yield asked, master
    os.close(master)


@pytest.mark.parametrize("name", SIGNALS)
def test_every_deadly_signal_asks_to_stop(asked, name):
    signal.raise_signal(getattr(signal, name))
    assert asked[0]() == f"the operator stopped it ({name})"


@pytest.mark.parametrize("key", KEYS)
def test_every_key_asks_to_stop(asked, key):
    os.write(asked[1], KEYS[key])
    assert asked[0]() == "the operator pressed a key"


@pytest.mark.parametrize("name", [name for name in SIGNALS if name in OF_A_WHOLE_RUN])
def test_a_signal_brakes_the_arm(configure, tmp_path, name):
    process, log = started(configure, tmp_path, stderr=subprocess.PIPE, text=True)
    with process:
        wait_for_rows(log, process)
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=60)
    ended(process, log, said, f"the operator stopped it ({name})")


def test_eight_signals_are_one(configure, tmp_path):
    process, log = started(configure, tmp_path, stderr=subprocess.PIPE, text=True)
    with process:
        wait_for_rows(log, process)
        for _ in range(8):
            process.send_signal(signal.SIGINT)
            time.sleep(0.03)
        _, said = process.communicate(timeout=60)
    ended(process, log, said, "the operator stopped it (SIGINT)")


@pytest.mark.parametrize("key", [key for key in KEYS if key in OF_A_WHOLE_RUN])
def test_a_key_brakes_the_arm(configure, tmp_path, key):
    master, terminal = pty.openpty()
    process, log = started(configure, tmp_path, stdin=terminal, stderr=subprocess.PIPE, text=True)
    with process:
        wait_for_rows(log, process)
        os.write(master, KEYS[key])
        _, said = process.communicate(timeout=60)
    os.close(master)
    os.close(terminal)
    ended(process, log, said, "the operator pressed a key")


def test_a_terminal_that_is_closed_brakes_the_arm(configure, tmp_path):
    master, terminal = pty.openpty()
    process, log = started(configure, tmp_path, stdin=terminal, stdout=terminal, stderr=terminal)
    os.close(terminal)
    with process:
        wait_for_rows(log, process)
        os.close(master)
        assert process.wait(60) == 5
    assert read_recording(log).complete


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_before_the_arm_moves_leaves_nothing_behind(configure, tmp_path, name):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    process, log = started(
        configure,
        tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(scratch)},
    )
    with process:
        deadline = time.monotonic() + 60
        while not any(p.is_dir() for p in scratch.iterdir()) and time.monotonic() < deadline:
            time.sleep(0.005)  # tempfile tries the folder with a file first, which is gone at once
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=60)
    assert process.returncode == 5
    assert notes_apart(said) == f"The operator stopped it ({name}) while no drive was enabled.\n"
    assert list(scratch.iterdir()) == []
    assert not log.exists()
    deadline = time.monotonic() + 60
    while any(str(scratch) in line for line in commands()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(str(scratch) in line for line in commands())


def commands():
    return [" ".join(p.info["cmdline"] or []) for p in psutil.process_iter(["cmdline"])]
