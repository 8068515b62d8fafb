"""What is left when the experiment's process is killed (SIGKILL) at random times, in real time.

Usage: scripts/benchmarks/killed_loop.py [TIMES], from the root, with .venv's Python. Each time, the
simulated arm is served in real time, the shipped experiment runs on it, and is killed within its
first fifteen seconds of cycles. Prints how long after the last SYNC the last drive said that
it had stopped by itself (EMCY 0x8700, SYNC lost) or the watchdog process had ordered it to leave
OPERATIONAL, and how much of the log's end is missing. A loop that ends before it is killed is not
counted; what it said is printed.
"""

import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import can
import numpy as np
from served_arm import program, served

from wamctl.arm.recording import read_recording

PERIOD_S = 0.002
DRIVES = 7
SYNC, EMERGENCY, SYNC_LOST = 0x080, 0x080, 0x8700
NMT, PRE_OPERATIONAL = 0x000, 0x80


class Listener(can.Listener):
    """Counts SYNC, and notes when each drive first says that it lost it, or is sent away."""

    def __init__(self) -> None:
        self.syncs, self.last_sync_s = 0, 0.0
        self.stopped_s: dict[int, float] = {}

    def on_message_received(self, msg: can.Message) -> None:
        """One frame."""
        now = time.monotonic()
        if msg.arbitration_id == SYNC and not self.stopped_s:  # later ones are the watchdog's
            self.syncs, self.last_sync_s = self.syncs + 1, now
        elif not self.syncs:
            return  # the set-up
        elif msg.arbitration_id == NMT and msg.data[0] == PRE_OPERATIONAL:
            self.stopped_s.setdefault(msg.data[1], now)
        elif EMERGENCY < msg.arbitration_id <= EMERGENCY + DRIVES:
            if int.from_bytes(msg.data[:2], "little") == SYNC_LOST:
                self.stopped_s.setdefault(msg.arbitration_id - EMERGENCY, now)


def killed_after(seconds: float, folder: Path) -> tuple[float, float] | None:
    """Time until the drives have stopped, and missing end of the log [s]; None if it ended before.

    Times are infinite where a drive did not say that it stopped.
    """
    socket, log, listener = folder / "bus", folder / "log.mcap", Listener()
    command = [program("wamctl"), "excite", "--config", "wam7.yaml", "--bus", f"simbus:{socket}"]
    command += ["--yes-move-the-arm", "wam7", "--out", str(log)]
    with (
        served("wam7.yaml", f"simbus:{socket}"),
        can.Bus(interface="simbus", channel=str(socket)) as bus,
    ):
        notifier = can.Notifier(bus, [listener])
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as loop:
            while listener.syncs == 0 and loop.poll() is None:
                time.sleep(0.01)
            time.sleep(seconds)
            ended = loop.poll() is not None
            loop.send_signal(signal.SIGKILL)
            said = loop.stderr.read().strip() if loop.stderr else ""
        time.sleep(0.5)
        notifier.stop()
        if ended:
            print(f"\nnot killed in time: {said}", file=sys.stderr)
            return None
        cycles = listener.syncs
        if len(listener.stopped_s) < DRIVES:
            return float("inf"), float("inf")
        stopped_s = max(listener.stopped_s.values()) - listener.last_sync_s
    while not read_recording(log).complete:  # the writer closes it when its loop has died
        time.sleep(0.1)
    return stopped_s, (cycles - len(read_recording(log).q)) * PERIOD_S


def main() -> None:
    """The figures."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    random = np.random.default_rng(0)
    found = []
    for k, seconds in enumerate(random.uniform(0.5, 15.0, times)):
        with tempfile.TemporaryDirectory() as folder:
            result = killed_after(float(seconds), Path(folder))
        found += [result] if result else []
        print(f"\r{k + 1} of {times}", end="", file=sys.stderr, flush=True)
    stopped, missing = np.array(found).T
    print(f"\nkilled {len(found)} times")
    print(f"drives stopped: after {1e3 * stopped.max():.0f} ms at the latest")
    print(f"end of the log that is missing: {missing.max():.2f} s at the most")


if __name__ == "__main__":
    main()
