#!/usr/bin/env -S .venv/bin/python
"""Whoever does the work, and whatever happens to him: the results of `ident fleet`, byte by byte.

Usage: scripts/benchmarks/fleet_workers.py LOGS OUT [--robot wam7.yaml] [--kill-s 60]

Processes 1, 2 and 4; then a Dask scheduler with two workers, each a process of its own, of which
one is killed every --kill-s seconds and started again, and the scheduler as well, once, after
half of the logs.
"""

import argparse
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

FILES = ("logs.parquet", "parameters.parquet", "changes.json", "fleet.json")


def fleet(given: argparse.Namespace, out: Path, *words: str) -> subprocess.Popen:
    """The command on all logs."""
    command = [sys.executable, "-m", "ident.cli", "fleet", str(given.logs)]
    command += ["--robot", given.robot, "--out", str(out), *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL)


class Cluster:
    """A scheduler and its workers, processes that may be killed."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self._port}"
        self._scheduler = self._scheduled()
        self._workers = [self._worker(), self._worker()]
        self.killed = 0

    def _scheduled(self) -> subprocess.Popen:
        return self._started("scheduler", "--port", str(self._port), "--no-dashboard")

    def _worker(self) -> subprocess.Popen:
        return self._started("worker", self.address, "--nthreads", "1", "--no-nanny")

    def _started(self, *words: str) -> subprocess.Popen:
        command = [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill_worker(self) -> None:
        """Kill the one that has lived longer, and start another."""
        first = self._workers.pop(0)
        first.send_signal(signal.SIGKILL)
        first.wait()
        self.killed += 1
        self._workers.append(self._worker())

    def kill_scheduler(self) -> None:
        """Kill the scheduler, and start another at its address; workers end with it."""
        self._scheduler.kill()
        self._scheduler.wait()
        time.sleep(1.0)
        self._scheduler = self._scheduled()

    def revive(self) -> None:
        """Start workers that have ended again."""
        gone = [w for w in self._workers if w.poll() is not None]
        self._workers = [w for w in self._workers if w not in gone] + [self._worker() for _ in gone]

    def close(self) -> None:
        """End all."""
        for process in (*self._workers, self._scheduler):
            process.kill()
            process.wait()


def troubled(given: argparse.Namespace, out: Path) -> int:
    """The command with a scheduler and workers that get killed; gives how many workers were."""
    half = sum(1 for _ in given.logs.rglob("*.mcap")) // 2
    cluster = Cluster()
    try:
        time.sleep(5.0)
        running = fleet(given, out, "--scheduler", cluster.address, "--workers", "1")
        last, restarted = time.monotonic(), False
        while running.poll() is None:
            time.sleep(0.5)
            cluster.revive()
            reduced = sum(1 for _ in (out / "reduced" / "logs").rglob("*.parquet"))
            if not restarted and reduced >= half:
                cluster.kill_scheduler()
                restarted = True
                print(f"scheduler killed after {reduced} logs", flush=True)
            if time.monotonic() - last > given.kill_s and reduced < 2 * half:
                cluster.kill_worker()
                last = time.monotonic()
        print(f"ended with {running.returncode}; {cluster.killed} workers killed")
        return cluster.killed
    finally:
        cluster.close()


def main() -> None:
    """Runs and compares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--robot", default="wam7.yaml")
    parser.add_argument("--kill-s", type=float, default=60.0)
    given = parser.parse_args()
    for count in (1, 2, 4):
        fleet(given, given.out / f"{count}", "--workers", str(count)).wait()
    troubled(given, given.out / "killed")
    for other in ("2", "4", "killed"):
        same = [
            (given.out / other / name).read_bytes() == (given.out / "1" / name).read_bytes()
            for name in FILES
        ]
        print(f"{other}: {'the same bytes' if all(same) else dict(zip(FILES, same, strict=True))}")


if __name__ == "__main__":
    main()
