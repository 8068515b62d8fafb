#!/usr/bin/env -S .venv/bin/python
"""`ident watch` on arms of `fleet_maker.py`: false alarms in plain motion, undeclared loads found.

Usage: scripts/benchmarks/watch.py OUT [--arms 4] [--plain 2] [--loaded 5] [--seed 0]

Each arm gets a model of its own from four minutes of its ordinary motion. Then it is watched in
new motions of some minutes: plain ones, and ones in which 0.5 kg lies at the tool from the start.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from fleet_maker import CENTRE, REACH, WAM, arm, changed, find_file, load_robot, write

from ident.recordings.loading import Reading
from ident.workflows.fleet.watch import watched
from ident.workflows.run import run_logs


def main() -> None:
    """Makes, watches and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=4)
    parser.add_argument("--plain", type=int, default=2)
    parser.add_argument("--loaded", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    robot = load_robot(find_file(Path("wam7.urdf")).read_text(encoding="utf-8"), WAM)
    hours, false, delays, masses, named, cpu = 0.0, [], [], [], 0, 0.0

    def made(name, truth, seed, moves):
        rng = np.random.default_rng((given.seed, seed))
        route = CENTRE + REACH * rng.uniform(-1, 1, (moves, 7))
        path = given.out / f"{name}.mcap"
        write(path, robot.model.copy(), robot.joint_names, truth, (0, 24.0, route, rng))
        return path

    for number in range(given.arms):
        truth = arm(robot.model.copy(), np.random.default_rng((given.seed, 1000 + number)))
        loaded, _ = changed(truth, "payload", 0, np.random.default_rng(0))
        folder = given.out / f"model{number}"
        log = made("fit", truth, 10 * number, 120)
        run_logs([log], find_file(Path("wam7.yaml")), folder, Reading())
        model = folder / "model.yaml"
        for k in range(given.plain + given.loaded):
            plain = k < given.plain
            today = truth if plain else replace(loaded)
            log = made("watched", today, 10_000 * (k + 1) + number, 150 if plain else 12)
            start = time.process_time()
            said = list(watched(str(log), model, Reading(), 0.0))
            if plain:
                cpu += time.process_time() - start
                hours += said[-1]["motion_s"] / 3600
                false += [s["kind"] + str(s["joints"]) for s in said[:-1]]
                kinds = [(s["kind"], s["joints"], round(s["evidence"], 1)) for s in said[:-1]]
                print(f"arm {number}, plain: {len(kinds)} {kinds[:6]}", flush=True)
                continue
            first = next((s for s in said if s["kind"] == "payload"), None)
            if first is None:
                print(f"arm {number}, loaded: {[s['kind'] for s in said[:-1]]}")
                continue
            named += said[0]["kind"] == "payload"
            delays.append(first["told_ns"] * 1e-9 - first_instant(log))
            masses.append(first["parameters"]["mass"]["value"])
    print(f"plain: {len(false)} alarms in {hours:.2f} h of motion: {sorted(set(false))}")
    print(f"CPU: {cpu:.1f} s for {hours * 3600:.0f} s of motion")
    runs = given.arms * given.loaded
    print(f"loaded: {named} of {runs} told first as payload; {len(delays)} told at all")
    print(
        json.dumps({"delays_s": np.round(delays, 2).tolist(), "kg": np.round(masses, 3).tolist()})
    )


def first_instant(log: Path) -> float:
    """Stamp of a log's first message [s]."""
    from ident.recordings.log_summary import summarise_log
    from wamctl.arm.recording import LogFile

    return summarise_log(LogFile(log), log.name).first_ns * 1e-9


if __name__ == "__main__":
    main()
