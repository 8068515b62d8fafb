"""Two commands on one bus: the second is refused and sends nothing, and the first goes on."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import yaml

from wamctl.arm.config import find_file
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory

pytestmark = pytest.mark.alone

MOVES = "--yes-move-the-arm wam7 --out"
COMMANDS = {
    "check": "",
    "bench": "--seconds 1",
    "monitor": "",
    "home": "",
    "excite": f"{MOVES} {{folder}}/{{number}}.mcap",
    "investigate": f"{MOVES} {{folder}}/{{number}}",
}
ENDS = {
    "check": {0},
    "bench": {0},
    "monitor": {0, 5},
    "home": {2},
    "excite": {5},
    "investigate": {5},
}
"""How each ends alone; the last four are told to end, or that nobody is at the keyboard."""

LAUNCHER = """
import os, sys
from wamctl.cli import main
from wamctl.commands import bench, check, excite, home, investigate, monitor

def child(number, words):
    for name, end in (("/dev/null", 0), (f"{sys.argv[1]}/{number}.out", 1)):
        os.dup2(os.open(name, os.O_RDWR | os.O_CREAT), end)
    os.dup2(1, 2)
    sys.argv[:] = ["wamctl", *words]
    code = 0
    try:
        main()
    except SystemExit as ended:
        code = ended.code or 0
    finally:
        sys.stdout.flush()
        os._exit(code)

for line in sys.stdin:
    what, number, *words = line.split()
    if what == "start":
        print(os.fork() or child(number, words), flush=True)
    else:
        print(os.waitstatus_to_exitcode(os.waitpid(int(number), 0)[1]), flush=True)
"""


class Launcher:
    """Starts each command as a process of its own, from one that has loaded what they need."""

    def __init__(self, folder: Path, config: Path, bus: str) -> None:
        self.folder, self.config, self.bus = folder, config, bus
        self.started = 0
        program, pipe = [sys.executable, "-c", LAUNCHER, str(folder)], subprocess.PIPE
        self.process = subprocess.Popen(program, stdin=pipe, stdout=pipe, text=True)

    def start(self, name: str) -> int:
        """The process of a command."""
        self.started += 1
        options = COMMANDS[name].format(folder=self.folder, number=self.started)
        words = f"{name} --config {self.config} --bus {self.bus} {options}"
        return self.told(f"start {self.started} {words}")

    def code(self, pid: int) -> int:
        """The exit code of a process."""
        return self.told(f"wait {pid}")

    def told(self, line: str) -> int:
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def said(self, number: int) -> str:
        """What the command that was started as this one has printed."""
        return (self.folder / f"{number}.out").read_text()


def configuration(folder: Path) -> Path:
    """The shipped arm with a short motion, on a machine that may hold either side up for 0.1 s."""
    content = yaml.safe_load(find_file("wam7.yaml").read_text())
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    content["drives"]["dictionary"] = str(find_file("puck4.eds"))
    content["drives"] |= {"sync_loss_ms": 100}
    content["safety"] |= {"missed_cycles": 50}
    content["excitation"] |= {"trajectory": "short.yaml", "ramp_s": 0.5}
    start, sine = np.array(content["simulation"]["start_pose_rad"]), np.full((7, 1), 0.2)
    series = FourierSeries(tuple(content["robot"]["joints"]), 6.0, sine, 0 * sine, start)
    write_trajectory(folder / "short.yaml", Trajectory(series, 1, {}, {}))
    (folder / "arm.yaml").write_text(yaml.safe_dump(content))
    return folder / "arm.yaml"


@contextmanager
def served(config: Path, bus: str):
    """The simulated arm in real time."""
    program = str(Path(sys.executable).with_name("sim-bus"))
    command = [program, "serve", "--config", str(config), "--bus", bus, "--stop-with-stdin"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as server:
        server.stdout.readline()
        yield
        server.stdin.close()


def wait_until_locked(bus: str) -> None:
    """The lock is a name in the kernel's list of sockets: looking there takes it from nobody."""
    end_s, name = time.monotonic() + 30, hashlib.sha256(bus.encode()).hexdigest()
    while f"@wamctl-{name}" not in Path("/proc/net/unix").read_text():
        assert time.monotonic() < end_s, "the first command never took the bus"
        time.sleep(0.002)


@pytest.fixture(scope="module")
def launcher(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two")
    config, bus = configuration(folder), f"simbus:{folder}/bus"
    with served(config, bus):
        made = Launcher(folder, config, bus)
        with made.process:
            yield made
            made.process.stdin.close()


@pytest.mark.parametrize("first", COMMANDS)
def test_a_second_command_is_refused_and_the_first_goes_on(launcher, first):
    """The first one stands still for as long as it takes to see the others refused."""
    pid, number = launcher.start(first), launcher.started
    wait_until_locked(launcher.bus)
    os.kill(pid, signal.SIGSTOP)
    try:
        all_others_are_refused(launcher)
    finally:
        os.kill(pid, signal.SIGCONT)
    if first in ("monitor", "excite", "investigate"):
        time.sleep(0.8)
        os.kill(pid, signal.SIGTERM)
    assert launcher.code(pid) in ENDS[first], launcher.said(number)


def all_others_are_refused(launcher: Launcher) -> None:
    sentence = f"Bus {launcher.bus} is in use by another wamctl on this machine; nothing was sent"
    for second in COMMANDS:
        other = launcher.start(second)
        assert launcher.code(other) == 4
        assert launcher.said(launcher.started).strip().splitlines()[-1].startswith(sentence)
