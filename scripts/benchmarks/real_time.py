"""The whole experiment in real time, arm and loop in processes of their own: what got lost or late.

Usage: scripts/benchmarks/real_time.py [CONFIG] [OPTION...], from the root, with .venv's Python.

    --bus INTERFACE:CHANNEL  where; a socket of the embedded bus without it
    --fd                     CAN FD (1 and 5 Mbit/s) at 1 kHz
    --hogs                   beside it, a process on each core that never rests
    --periods N              of 20 s each; 3 without it, the shipped minute

On a kernel with vcan, behind scripts/vcan-test .venv/bin/python, with --bus socketcan:vcan0.
Prints how it ended, with the sentence of a stop, the loop's figures, the processor time of each
side, and two things by which the machine, not the driver, may hold a cycle up: the kernel's limit
on real-time processes (sched_rt_runtime_us: who needs more than that share of a second is held up
for the rest of it), and the time that a virtual machine's host has kept from its cores meanwhile.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import yaml
from served_arm import TICK_S, program, served, spent_s

from wamctl.arm.config import find_file

HOG = "import os; os.sched_setaffinity(0, {int(__import__('sys').argv[1])})\nwhile True: pass"
LIMIT = Path("/proc/sys/kernel/sched_rt_runtime_us")
STOLEN = 8  # place of that time in the first line of /proc/stat


def configuration(shipped: str, folder: Path, periods: int, fd: bool) -> Path:
    """A shipped arm with so many periods; on CAN FD, with half the cycle time."""
    content = yaml.safe_load(find_file(shipped).read_text())
    for section, key in (
        ("robot", "urdf"),
        ("drives", "dictionary"),
        ("excitation", "trajectory"),
    ):
        if key in content[section]:
            content[section][key] = str(find_file(content[section][key]))
    motion = yaml.safe_load(Path(content["excitation"]["trajectory"]).read_text())
    (folder / "motion.yaml").write_text(yaml.safe_dump(motion | {"periods": periods}))
    content["excitation"]["trajectory"] = "motion.yaml"
    if fd:
        content["bus"] |= {"period_s": 0.001, "data_bitrate_bit_s": 5_000_000}
        content["safety"]["missed_cycles"] *= 2
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@contextmanager
def hog(core: int) -> Iterator[None]:
    """A process that never rests, until the block ends."""
    with subprocess.Popen([sys.executable, "-c", HOG, str(core)]) as process:
        try:
            yield
        finally:
            process.terminate()


def stolen_s() -> float:
    """Time that the host of a virtual machine has kept from all its cores, since the start [s]."""
    return (
        int(Path("/proc/stat").read_text(encoding="ascii").split("\n")[0].split()[STOLEN]) * TICK_S
    )


def experiment(config: str, arm: str, bus: str, log: Path) -> None:
    """One experiment on a served arm; prints its figures."""
    excite = [program("wamctl"), "excite", "--config", config, "--bus", bus, "--json"]
    excite += ["--yes-move-the-arm", arm, "--out", str(log)]
    with served(config, bus) as (server, ready):
        print(ready)
        pipe = subprocess.PIPE
        with subprocess.Popen(excite, stdout=pipe, stderr=pipe, text=True) as loop:
            before, began, stolen = spent_s(server), time.monotonic(), stolen_s()
            took = {}
            while loop.poll() is None:
                took = {"loop": spent_s(loop.pid), "arm": spent_s(server) - before}
                time.sleep(0.5)
            said = loop.stdout.read() if loop.stdout else ""
            sentence = loop.stderr.read().strip() if loop.stderr else ""
    print(f"exit code {loop.returncode}{': ' if sentence else ''}{sentence}")
    if said:
        print(json.dumps(json.loads(said), indent=1))
    passed = time.monotonic() - began
    for name, used in took.items():
        print(f"{name}: {100.0 * used / passed:.0f} % of a core")
    print(f"kept from us by the host: {100.0 * (stolen_s() - stolen) / passed:.1f} % of a core")


def main() -> None:
    """The figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("config", nargs="?", default="wam7.yaml")
    parser.add_argument("--bus")
    parser.add_argument("--fd", action="store_true")
    parser.add_argument("--hogs", action="store_true")
    parser.add_argument("--periods", type=int, default=3)
    asked = parser.parse_args()
    limit = LIMIT.read_text().strip() if LIMIT.exists() else "unknown"
    print(f"sched_rt_runtime_us {limit}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        config = str(configuration(asked.config, Path(folder), asked.periods, asked.fd))
        arm = yaml.safe_load(find_file(config).read_text())["arm"]
        for core in sorted(os.sched_getaffinity(0)) if asked.hogs else ():
            stack.enter_context(hog(core))
        bus = asked.bus or f"simbus:{folder}/bus"
        experiment(config, arm, bus, Path(folder) / "log.mcap")


if __name__ == "__main__":
    main()
