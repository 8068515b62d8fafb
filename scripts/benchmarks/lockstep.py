"""Speed of a whole lockstep run, and what each side of the wire spends on a cycle.

Run: .venv/bin/python scripts/benchmarks/lockstep.py [CONFIG [TRAJECTORY]]

`wamctl excite` starts the simulated arm itself and moves it. Counted is from the first cycle on:
when the log's writer runs, models are loaded and everything is compiled. Processor times are user
and system time together, and count the time for which each side looks out for the other. The
last line is a plain loop of this interpreter, which takes about 0.2 s on an idle machine of the
year 2022: on a busy one, read all figures relative to it.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from served_arm import plain_loop, program, spent_s

PERIOD_S = 0.002
LOOK_S = 0.05


def children(pid: int) -> dict[str, int]:
    """The programs that a process has started: the simulated arm, and the log's writer."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    found = {}
    for child in listed:
        words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
        for name, word in (("simulated arm", b"serve"), ("writer", b"wamctl.telemetry.writer")):
            if word in words:
                found[name] = int(child)
    return found


def watch(run: subprocess.Popen[str]) -> dict[str, float]:
    """What each process spends while the arm is cycled [s]."""
    first: dict[str, float] = {}
    last: dict[str, float] = {}
    while run.poll() is None:
        try:
            found = {"wamctl": run.pid} | children(run.pid)
            if "writer" in found:
                last = {name: spent_s(pid) for name, pid in found.items()}
                first = first or last
        except (FileNotFoundError, ProcessLookupError):  # one has just ended
            continue
        time.sleep(LOOK_S)
    return {name: last[name] - first[name] for name in first if name in last}


def main() -> None:
    """Print the figures."""
    config = sys.argv[1] if len(sys.argv) > 1 else "wam7.yaml"
    command = [
        program("wamctl"),
        "excite",
        "--config",
        config,
        "--bus",
        "sim",
        "--lockstep",
        "--json",
    ]
    command += ["--trajectory", sys.argv[2]] if len(sys.argv) > 2 else []
    with tempfile.TemporaryDirectory() as folder:
        log = f"{folder}/log.mcap"
        with subprocess.Popen([*command, "--out", log], stdout=subprocess.PIPE, text=True) as run:
            spent = watch(run)
            result = json.loads(run.stdout.read() if run.stdout else "")
    cycles, speed = result["cycles"], result["speed"]
    micros = PERIOD_S / speed * 1e6
    sys.stdout.write(f"{cycles} cycles: {micros:.0f} us each, {speed:.2f} times real time\n")
    for name, seconds in spent.items():
        sys.stdout.write(f"  {name}: {seconds / cycles * 1e6:.0f} us of processor time a cycle\n")
    sys.stdout.write(plain_loop())


if __name__ == "__main__":
    main()
