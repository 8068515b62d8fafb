"""The command `sim-bus serve` as a process."""

import signal
import subprocess
import sys
from contextlib import contextmanager

import can
import pytest
import yaml
from typer.testing import CliRunner

from sim_bus.cli import app
from wamctl.arm.config import shipped_file

pytestmark = pytest.mark.alone


def command(*arguments):
    return [sys.executable, "-c", "from sim_bus.cli import main; main()", "serve", *arguments]


@contextmanager
def started(*arguments):
    pipe = subprocess.PIPE
    process = subprocess.Popen(command(*arguments), stdin=pipe, stdout=pipe, stderr=pipe, text=True)
    with process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def run():
    """The command in this process, whose signal handlers it replaces."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    yield lambda *arguments: CliRunner().invoke(app, ["serve", *arguments])
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_says_when_it_is_ready_and_ends_cleanly(tmp_path, number):
    path, truth = tmp_path / "bus", tmp_path / "truth.yaml"
    bus = f"simbus:{path}"
    options = ("--lockstep", "--seed", "3", "--truth", str(truth))
    with started("--config", "wam7.yaml", "--bus", bus, *options) as process:
        assert process.stdout.readline() == (
            f"sim-bus is ready on {bus}: 7 drives, seed 3, lockstep.\n"
        )
        assert yaml.safe_load(truth.read_text())["seed"] == 3
        with can.Bus(interface="simbus", channel=str(path)):
            process.send_signal(number)
            assert process.wait(10) == 0
        said = process.stderr.read()
        assert [line for line in said.splitlines() if not line.startswith("note: ")] == []
    assert not path.exists()


def test_it_ends_with_its_standard_input(tmp_path):
    bus = f"simbus:{tmp_path}/bus"
    with started("--config", "wam7.yaml", "--bus", bus, "--stop-with-stdin") as process:
        assert process.stdout.readline().startswith(f"sim-bus is ready on {bus}: 7 drives, seed 0")
        process.stdin.close()
        assert process.wait(10) == 0
        assert process.stdout.read() == (
            "The bus carried 7 frames; its load was 0 % in the busiest second.\n"
        )


@pytest.mark.parametrize(
    ("config", "bus", "status", "sentence"),
    [
        (
            "wam7.yaml",
            "can0",
            4,
            "sim-bus got the bus 'can0': name it as INTERFACE:CHANNEL, such as simbus:/tmp/arm or "
            "socketcan:vcan0.",
        ),
        (
            "wam7.yaml",
            "simbus:/no/such/folder/bus",
            4,
            "sim-bus cannot make the socket /no/such/folder/bus (No such file or directory): name "
            "a path in a folder that exists and is writable, with less than 108 characters.",
        ),
        (
            "none.yaml",
            "simbus:/tmp/bus",
            3,
            "none.yaml: no such file, and none of that name is shipped (shipped: "
            + ", ".join(sorted(p.name for p in shipped_file("").glob("*.yaml")))
            + ").",
        ),
    ],
)
def test_a_mistake_is_one_sentence_and_an_exit_code(run, config, bus, status, sentence):
    done = run("--config", config, "--bus", bus)
    assert (done.exit_code, done.stderr, done.stdout) == (status, sentence + "\n", "")


def test_a_file_without_simulation_is_refused(run, tmp_path):
    content = yaml.safe_load(shipped_file("wam7.yaml").read_text())
    del content["simulation"]
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    done = run("--config", str(path), "--bus", "simbus:/tmp/bus")
    assert done.exit_code == 3
    assert done.stderr == f"{path}: simulation: missing, so there is no arm to simulate.\n"
