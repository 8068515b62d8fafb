#!/usr/bin/env -S .venv/bin/python
"""`ident watch` on arms of `fleet_maker.py`: false alarms in plain motion, undeclared loads found.

Usage: scripts/benchmarks/watch.py OUT [--arms 12] [--moves 150] [--hours 100] [--loads 25]
           [--simulated 1] [--rate 250] [--seed 0]

Each arm gets a model of its own from four minutes of its ordinary motion, and is watched in a new
one of --moves moves. From the windows of this motion, by arithmetic:

- plain hours: minutes of motion made of stretches of five seconds drawn at random, each minute
  looked at every twelve seconds; any odds above those that the watch asks for are a false alarm;
- loads: 0.5 kg at the tool, which adds N d to a window's score, from a random window on.

--simulated motions an arm have the load in the simulation, to see that the arithmetic is right.
"""

import argparse
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import fleet_maker
import numpy as np
from fleet_maker import CENTRE, REACH, WAM, Truth, arm, changed, find_file, load_robot, write

from ident.effects.bound_effects import load_model
from ident.fleet.normal import Information
from ident.recordings.loading import Reading
from ident.recordings.samples import TorqueSource
from ident.watch.residual import PAYLOAD, Residual, Window
from ident.watch.samples import Sampler
from ident.watch.settings import DEFAULT
from ident.watch.sources import messages
from ident.watch.watcher import Alarm, Watcher
from ident.workflows.run import run_logs

TOPICS = ("/joint_states", "/joint_commands")
MEASURED: TorqueSource = "measured"
STRETCH, LOOK = 10, 24  # windows
KG, CENTRE_M = 0.5, np.array([0.02, -0.01, 0.06])


class Watched:
    """One arm with its model.

    Args:
        truth: the arm.
        folder: for logs and model.
        number: of the arm, from which its motions follow.
    """

    def __init__(self, truth: Truth, folder: Path, number: int) -> None:
        self.truth, self._folder, self._number = truth, folder, number
        log = self.log(truth, 0, 120)
        run_logs([log], find_file(Path("wam7.yaml")), folder / "model", Reading())
        self.model = load_model(folder / "model" / "model.yaml")

    def log(self, truth: Truth, number: int, moves: int) -> Path:
        """A recording of a motion."""
        rng = np.random.default_rng((self._number, number))
        route = CENTRE + REACH * rng.uniform(-1, 1, (moves, len(CENTRE)))
        robot = load_robot(find_file(Path("wam7.urdf")).read_text(encoding="utf-8"), WAM)
        path = self._folder / f"{number}.mcap"
        write(path, robot.model.copy(), robot.joint_names, truth, (0, 24.0, route, rng))
        return path

    def watcher(self) -> Watcher:
        """A watch that has seen nothing."""
        return Watcher(self.model, Residual(self.model, DEFAULT), DEFAULT)

    def windows(self, log: Path) -> list[Window]:
        """What the watch looks at in a recording."""
        residual = Residual(self.model, DEFAULT)
        sampler = Sampler(self.model.robot.joint_names, TOPICS, MEASURED, log.name)
        batches = sampler.samples(messages(str(log), TOPICS, 0.0))
        return [w for samples in batches for w in residual.windows(samples)]

    def alarms(self, windows: Iterable[Window]) -> list[Alarm]:
        """All that is told."""
        watcher = self.watcher()
        return [found for w in windows if (found := watcher.look(w)) is not None]

    def highest(self, windows: list[Window], blocks: int, rng: np.random.Generator) -> list[float]:
        """Highest log odds of so many blocks drawn from the windows."""
        found, size = [], DEFAULT.block_windows
        for _ in range(blocks):
            test, most = self.watcher().test, -np.inf
            starts = rng.integers(0, len(windows) - STRETCH, size // STRETCH)
            drawn = [windows[s + k] for s in starts for k in range(STRETCH)]
            for number, window in enumerate(drawn, 1):
                test.take(window.said)
                if number % LOOK == 0:
                    most = max(most, test.odds().whole)
            found.append(most)
        return found


def loaded(window: Window) -> Window:
    """The window as it would be with the load at the tool."""
    d = np.zeros(len(window.said.y))
    tensor = KG * (CENTRE_M @ CENTRE_M * np.eye(3) - np.outer(CENTRE_M, CENTRE_M))
    d[:PAYLOAD] = [KG, *(KG * CENTRE_M), *tensor[np.triu_indices(3)]]
    said = window.said
    return replace(window, said=Information(said.N, said.y + said.N @ d))


def told(alarms: list[Alarm], since_ns: int) -> tuple[float, float] | None:
    """Delay [s] and mass [kg] of the first alarm, where it names a load."""
    if not alarms or alarms[0].kind != "payload":
        return None
    return (alarms[0].told_ns - since_ns) * 1e-9, alarms[0].parameters["mass"].value


def summary(what: str, cases: list[tuple[float, float] | None]) -> None:
    """Prints how loads were told."""
    named = np.array([c for c in cases if c is not None]).reshape(-1, 2)
    soon = np.sum(named[:, 0] <= 4.0)
    off = np.abs(named[:, 1] / KG - 1)
    print(
        f"{what}: {len(named)} of {len(cases)} told first as payload, {soon} within 4 s;"
        f" delay {np.quantile(named[:, 0], [0.5, 0.95, 1]).round(2)} s (median, 95 %, most);"
        f" mass off by {100 * np.quantile(off, [0.5, 0.95, 1]).round(4)} %"
    )


def main() -> None:
    """Makes, watches and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=12)
    parser.add_argument("--moves", type=int, default=150)
    parser.add_argument("--hours", type=float, default=100.0)
    parser.add_argument("--loads", type=int, default=25)
    parser.add_argument("--simulated", type=int, default=1)
    parser.add_argument("--rate", type=float, default=fleet_maker.RATE_HZ)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    fleet_maker.RATE_HZ = given.rate
    robot = load_robot(find_file(Path("wam7.urdf")).read_text(encoding="utf-8"), WAM)
    rng = np.random.default_rng(given.seed)
    blocks = round(given.hours * 3600 / (DEFAULT.block_windows * DEFAULT.window_s) / given.arms)
    alarms, highest, planted, simulated = [], [], [], []
    motion_s = cpu_s = 0.0
    for number in range(given.arms):
        truth = arm(robot.model.copy(), np.random.default_rng((given.seed, 1000 + number)))
        one = Watched(truth, given.out / f"{number}", number + 1000 * given.seed)
        log = one.log(truth, 1, given.moves)
        start = time.process_time()
        windows = one.windows(log)
        here = one.alarms(windows)
        cpu_s += time.process_time() - start
        alarms += [a.kind for a in here]
        moving = [w for w in windows if w.moving]
        motion_s += len(moving) * DEFAULT.window_s
        highest += one.highest(moving, blocks, rng)
        for _ in range(given.loads):
            k = int(rng.integers(20, len(moving) - 20))
            seen = [*moving[k - 20 : k], *map(loaded, moving[k : k + 20])]
            planted.append(told(one.alarms(seen), moving[k].start_ns))
        with_load, _ = changed(truth, "payload", 0, rng)
        for k in range(given.simulated):
            seen = one.windows(one.log(with_load, 2 + k, 10))
            first_ns = seen[0].start_ns - round(1e9 * DEFAULT.start_s)
            simulated.append(told(one.alarms(seen), first_ns))
        print(f"arm {number}: {len(here)} alarms, highest {max(highest[-blocks:]):.1f}", flush=True)
    asked = DEFAULT.least_log_odds
    print(f"plain: {len(alarms)} alarms in {motion_s / 3600:.2f} h of motion {alarms}")
    print(f"CPU: {100 * cpu_s / motion_s:.1f} % of a core, reading included")
    over = np.sum(np.array(highest) >= asked)
    print(f"drawn: {over} minutes of {len(highest)} above {asked:.1f}; highest {max(highest):.1f}")
    summary("loads by arithmetic", planted)
    summary("loads in the simulation", simulated)


if __name__ == "__main__":
    main()
