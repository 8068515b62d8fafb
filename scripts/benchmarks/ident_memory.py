"""Peak memory of `ident run` or `ident gap` by length of log: the counted periods of one, repeated.

Usage: OMP_NUM_THREADS=1 python scripts/benchmarks/ident_memory.py LOG.mcap [--minutes 1 10 60]
       [--command run|gap]

LOG.mcap is a recording of `wamctl excite --bus sim`. Peak memory is what the kernel reports of the
finished process (ru_maxrss), imports included.
"""

import argparse
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ident.recordings.dataset import dataset
from ident.recordings.steady_state import only_steady_state
from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.recording import Recording, read_recording
from wamctl.arm.trajectory import read_trajectory, trajectory_yaml


def repeated(recording: Recording, out: Path, minutes: float) -> None:
    """A log in which the counted periods come again and again.

    Raises:
        ValueError: the recording lacks commands or reference.
    """
    command, reference = recording.command, recording.reference
    if command is None or reference is None or command.effort is None:
        raise ValueError("a log of `wamctl excite` is needed")
    data = dataset(recording, recording.joint_names, "log")
    first, end = only_steady_state(data, recording, "log").segments[0].used or (0, len(recording.q))
    period_s = 1 / data.rate_hz
    path = out.with_suffix(".yaml")
    path.write_bytes(recording.attachments["trajectory.yaml"])
    trajectory = read_trajectory(path)
    times = max(1, round(60 * minutes / ((end - first) * period_s)))
    longer = trajectory_yaml(replace(trajectory, periods=trajectory.periods * times))
    attachments = recording.attachments | {"trajectory.yaml": longer.encode()}
    places = np.concatenate(
        [np.arange(end), *[np.arange(first, end)] * (times - 1), np.arange(end, len(recording.q))]
    )
    with Recorder(out, recording.joint_names, recording.metadata, attachments) as recorder:
        for k, i in enumerate(places):
            recorder.cycle(
                CycleRecord(
                    round(k * period_s * 1e9),
                    recording.q[i],
                    recording.q[i] if recording.qd is None else recording.qd[i],
                    None if recording.effort is None else recording.effort[i],
                    reference.q[i],
                    reference.qd[i],
                    reference.qdd[i],
                    command.effort[i],
                )
            )


def peak_mb(command: str, log: Path, out: Path) -> tuple[float, float]:
    """Peak memory [MB] and time [s] of a command on a log.

    Raises:
        RuntimeError: it fails.
    """
    program = Path(sys.executable).parent / "ident"
    start = time.perf_counter()
    process = subprocess.Popen([program, command, log, "--out", out], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"ident {command} ended with {process.returncode}")
    return usage.ru_maxrss / 1024, time.perf_counter() - start


def main() -> None:
    """Print one line per length."""
    parser = argparse.ArgumentParser(description="Peak memory by length of the log.")
    parser.add_argument("log", type=Path)
    parser.add_argument("--minutes", type=float, nargs="+", default=[1, 10, 60])
    parser.add_argument("--command", choices=["run", "gap"], default="run")
    arguments = parser.parse_args()
    recording, first = read_recording(arguments.log), None
    with TemporaryDirectory() as name:
        folder = Path(name)
        for minutes in arguments.minutes:
            log = folder / f"{minutes:g}.mcap"
            repeated(recording, log, minutes)
            peak, seconds = peak_mb(arguments.command, log, folder / "out")
            log.unlink()
            first = first or peak
            print(f"{minutes:4g} min {peak:6.0f} MB {peak / first:5.2f} x {seconds:6.1f} s")


if __name__ == "__main__":
    main()
