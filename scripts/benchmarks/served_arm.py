"""The project's commands as processes: the simulated arm in its own, and what each one spends."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


def program(name: str) -> str:
    """A command of the project."""
    return str(Path(sys.executable).with_name(name))


@contextmanager
def served(config: str | Path, bus: str, *options: str) -> Iterator[tuple[int, str]]:
    """The simulated arm, until the block ends: its process, and the line that says it is ready."""
    command = [program("sim-bus"), "serve", "--config", str(config), "--bus", bus, *options]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*command, "--stop-with-stdin"], stdin=pipe, stdout=pipe, text=True
    ) as server:
        try:
            yield server.pid, server.stdout.readline().strip() if server.stdout else ""
        finally:
            if server.stdin:
                server.stdin.close()


def spent_s(pid: int) -> float:
    """User and system time of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def plain_loop() -> str:
    """How long this interpreter takes for a plain loop; 0.2 s on an idle machine of 2022."""
    began, total = time.perf_counter(), 0
    for k in range(3_000_000):
        total += k
    return f"plain loop of 3 million additions: {time.perf_counter() - began:.2f} s\n"
