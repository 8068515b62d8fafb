"""What `ident design` reaches, how surely, and against what.

Usage: OMP_NUM_THREADS=1 python scripts/benchmarks/excitation_design.py PART [--help]

seeds   condition numbers from several seeds under the published limits, for 57 and 69 parameters;
        `--constraints all` adds torque, collisions and speed of elbow and tool
cobyla  the paper's COBYLA and the default, from the same start and in the same time
limits  random designs under random limits, however bad, each checked again at 1 kHz by other means;
        `--chosen`: the motions of `ident plan`
errors  standard errors of the base parameters after a run of the designed and of a published motion
        on the simulated arm (needs the published motion's positions; see `--published`)

On a machine that has other work too, `--cpu` counts the search's time in CPU seconds of one process
(`--time` is wall time, as in the command). Both are printed.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from statistics import median

import numpy as np
from cobyla import search_by_cobyla
from numpy.typing import NDArray
from random_limits import breaches, random_arm

from ident.commands.design import Objective
from ident.dynamics.regressor import Motion
from ident.excitation.design import Design, DesignTask, design, finished, problem_of, task_of
from ident.excitation.effect_motions import PROBES, scattered
from ident.excitation.optimisation.deadline import within
from ident.excitation.optimisation.evaluate import Candidate
from ident.excitation.optimisation.search import random_start, search
from ident.excitation.problem.arm_limits import design_limits, possible_pose
from ident.excitation.problem.regressor_columns import exact_rows
from ident.excitation.problem.trajectory_grid import series_of
from ident.excitation.settings import DesignSettings
from ident.excitation.target_effect import drawn, frame_of
from ident.planning.choice import within_limits
from ident.workflows.design import place_of
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.trajectory import (
    FourierSeries,
    Trajectory,
    sample,
    write_trajectory,
)

Array = NDArray[np.floating]

_PUBLISHED = Path("excitation-published-limits.yaml")
_TERMS = {57: None, 69: ("viscous", "coulomb", "offset", "rotor_inertia")}
_ALLOWED = {57: 36.0, 69: 58.0}
_WITH_ALL = 1.3


def say(*words: object) -> None:
    """A line of the table, at once."""
    print(*words, flush=True)


def cpu_s() -> float:
    """CPU time of this process and of those that it has waited for [s]."""
    own, ended = (resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + ended.ru_utime + ended.ru_stime


def nothing(best: object) -> None:
    """Progress that nobody reads."""


def seeds(arguments: argparse.Namespace) -> None:
    """Condition numbers from several seeds."""
    place = place_of(_PUBLISHED, arguments.constraints)
    factor = 1.0 if arguments.constraints == "joint_motion" else _WITH_ALL
    say("parameters  seed  condition  wall [s]  CPU [s]  breaches at 1 kHz")
    for number in arguments.parameters:
        found = []
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            settings = DesignSettings(
                objective=arguments.objective,
                terms=_TERMS[number],
                seed=seed,
                time_s=arguments.time,
                processes=arguments.processes,
            )
            began, used = time.monotonic(), cpu_s()
            made = designed(place, settings, None, arguments.cpu)
            seconds, used = time.monotonic() - began, cpu_s() - used
            if arguments.keep is not None:
                arguments.keep.mkdir(parents=True, exist_ok=True)
                write_trajectory(arguments.keep / f"{number}-{seed}.yaml", made.trajectory)
            found.append(made.trajectory.promise["condition_number"])
            broken = len(breaches(place, made.trajectory))
            say(f"{number:10d} {seed:5d} {found[-1]:10.2f} {seconds:9.1f} {used:8.1f} {broken:6d}")
        allowed = factor * _ALLOWED[number]
        say(
            f"{number} parameters, {arguments.constraints}: best {min(found):.2f}, median "
            f"{median(found):.2f}, worst {max(found):.2f}; {sum(c <= allowed for c in found)} of "
            f"{len(found)} at most {allowed:.1f}"
        )


def designed(
    place: DesignTask,
    settings: DesignSettings,
    start: FourierSeries | None,
    cpu: bool,
    method: Callable[..., Iterator[Candidate]] | None = None,
) -> Design:
    """The work of `ident design`; with `cpu` in this process, with its time in CPU seconds."""
    if not cpu and method is None:
        return design(place, settings, start, nothing)
    pose = possible_pose(place.arm, place.robot, place.limits, place.source)
    task = task_of(place, settings, start)
    clock = time.process_time if cpu else time.monotonic
    effort = replace(task.effort, deadline=within(settings.time_s, clock))
    found = (method or search)(task.problem, task.dense, effort, settings.seed, task.start)
    best = min(found, key=lambda c: c.value, default=None)
    return finished(place, task, pose, best)


def cobyla(arguments: argparse.Namespace) -> None:
    """COBYLA and the default, from the same start, in the same time."""
    place = place_of(_PUBLISHED, arguments.constraints)
    say("parameters  seed     start   COBYLA  default   (condition number)   CPU [s]")
    for number in arguments.parameters:
        for seed in range(arguments.first, arguments.first + arguments.seeds):
            settings = DesignSettings(
                objective="condition",
                terms=_TERMS[number],
                seed=seed,
                time_s=arguments.time,
                processes=1,
            )
            problem = problem_of(place, settings)
            wild = random_start(problem, np.random.default_rng(seed))
            excitation = place.arm.excitation
            start = series_of(wild, place.robot.joint_names, excitation.fundamental_rad_s)
            t = np.linspace(0.0, start.period_s, 2000, endpoint=False)
            first = np.linalg.cond(exact_rows(problem.columns, Motion(*sample(start, t))))
            values, used = [], []
            for method in (search_by_cobyla, search):
                before = cpu_s()
                made = designed(place, settings, start, arguments.cpu, method)
                used.append(cpu_s() - before)
                values.append(made.trajectory.promise["condition_number"])
            say(
                f"{number:10d} {seed:5d} {first:9.1f} {values[0]:8.2f} {values[1]:8.2f} "
                f"{used[0]:25.0f} {used[1]:4.0f}"
            )


def limits(arguments: argparse.Namespace) -> None:
    """Random designs under random limits, each checked by other means; refusals counted."""
    whole = place_of(_PUBLISHED, "all")
    kept, broken, refusals = 0, [], []
    began = time.monotonic()
    for seed in count(arguments.first):
        if kept == arguments.designs:
            break
        rng = np.random.default_rng(seed)
        arm = random_arm(whole.arm, rng)
        try:
            place = DesignTask(arm, whole.robot, design_limits(arm, "random"), "random")
            if arguments.chosen:
                made = probed(place, seed)
            else:
                settings = DesignSettings(seed=seed, time_s=arguments.time)
                made = designed(place, settings, None, cpu=True)
        except ConfigurationError as error:
            refusals.append(str(error))
            if arguments.verbose:
                say(f"{seed}: {error}")
            continue
        kept += 1
        found = breaches(place, made.trajectory)
        if found:
            broken.append(seed)
            say(f"seed {seed}: {'; '.join(found)}")
        if kept % 100 == 0:
            say(f"{kept} designs, {len(refusals)} refusals, {time.monotonic() - began:.0f} s")
    say(f"{kept} designs, {len(broken)} with a breach at 1 kHz; {len(refusals)} sets refused")
    named = [r for r in refusals if any(w in r for w in _NAMES)]
    say(f"{len(named)} of {len(refusals)} refusals name the limit")
    for name in _NAMES:
        say(f"  {name:12s} {sum(name in r for r in refusals)}")


def probed(place: DesignTask, seed: int) -> Design:
    """A motion as `ident plan` chooses it: one of its probes, at any joint, within the limits."""
    rng = np.random.default_rng(seed)
    frame = frame_of(place, int(rng.integers(place.robot.dof)) + 1)
    builders = [*PROBES.values(), partial(scattered, seed=seed)]
    sketch = builders[int(rng.integers(len(builders)))](frame)
    fitted = within_limits(problem_of(place, DesignSettings()), sketch)
    if fitted is None:
        raise ConfigurationError("random", ["the probe fits into no position limit"])
    return drawn(place, fitted, frame.pose)


_NAMES = ("position", "velocity", "acceleration", "jerk", "torque", "slew", "speed", "distance")


def errors(arguments: argparse.Namespace) -> None:
    """Standard errors after a run of each motion on the simulated arm."""
    folder: Path = arguments.out
    folder.mkdir(parents=True, exist_ok=True)
    place = place_of(_PUBLISHED, "all")
    motions = {"published": published(arguments.published, place.robot.joint_names)}
    if arguments.designed is None:
        settings = DesignSettings(
            objective=arguments.objective,
            most_condition=arguments.most_condition,
            time_s=arguments.time,
            processes=arguments.processes,
        )
        made = designed(place, settings, None, arguments.cpu)
        motions["designed"] = made.trajectory.series
        say(f"designed: condition number {made.trajectory.promise['condition_number']}")
    sd = {}
    for name, series in motions.items():
        file = folder / f"{name}.yaml"
        write_trajectory(file, Trajectory(series, 3, {}, {}))
        sd[name] = run(file, arguments.seed)
    if arguments.designed is not None:
        sd["designed"] = run(arguments.designed, arguments.seed)
    ratios = np.array([sd["designed"][name] / sd["published"][name] for name in sd["published"]])
    for name, ratio in zip(sd["published"], ratios, strict=True):
        say(f"{name:24s} {sd['published'][name]:12.3g} {sd['designed'][name]:12.3g} {ratio:7.3f}")
    quartiles = np.percentile(ratios, [25, 50, 75])
    say(
        f"ratio of {len(ratios)} standard errors: median {quartiles[1]:.3f}, quartiles "
        f"{quartiles[0]:.3f} and {quartiles[2]:.3f}, largest {ratios.max():.3f}"
    )


def run(trajectory: Path, seed: int) -> dict[str, float]:
    """Run a motion on the simulated arm, identify, and read the standard errors."""
    log, model = trajectory.with_suffix(".mcap"), trajectory.with_suffix("")
    log.unlink(missing_ok=True)
    excite = ["wamctl", "excite", "--config", str(_PUBLISHED), "--bus", "sim", "--lockstep"]
    excite += ["--seed", str(seed), "--trajectory", str(trajectory), "--out", str(log)]
    subprocess.run(excite, check=True, stdout=sys.stderr)
    subprocess.run(["ident", "run", str(log), "--out", str(model)], check=True, stdout=sys.stderr)
    found = json.loads((model / "run.json").read_text(encoding="utf-8"))
    return {p["name"]: p["sd"] for p in found["base_parameters"]}


def published(positions: Path, names: tuple[str, ...]) -> FourierSeries:
    """The series of one period of positions, sampled at 500 Hz over 20 s."""
    spectrum = np.fft.rfft(np.loadtxt(positions, delimiter=",", skiprows=1), axis=0) / 10_000
    omega = 0.1 * np.pi * np.arange(1, 6)[:, None]
    a, b = -2 * spectrum[1:6].imag * omega, -2 * spectrum[1:6].real * omega
    return FourierSeries(names, 0.1 * np.pi, a.T, b.T, spectrum[0].real)


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(required=True)
    for work in (seeds, cobyla, limits, errors):
        part = parts.add_parser(work.__name__, help=work.__doc__)
        part.set_defaults(work=work)
        part.add_argument("--first", type=int, default=0, help="first seed")
        part.add_argument("--time", type=float, default=240.0, help="of each search [s]")
        if work in (seeds, cobyla):
            part.add_argument("--seeds", type=int, default=10)
            part.add_argument("--parameters", type=int, nargs="+", default=[57, 69])
            part.add_argument(
                "--constraints", choices=("joint_motion", "all"), default="joint_motion"
            )
        if work is seeds:
            part.add_argument("--keep", type=Path, help="folder for the designs")
        if work in (seeds, cobyla, errors):
            part.add_argument("--cpu", action="store_true", help="count CPU seconds, one process")
        if work in (seeds, errors):
            part.add_argument("--processes", type=int, default=2)
            part.add_argument("--objective", choices=list(Objective), help="unset: the default")
        if work is limits:
            part.add_argument("--designs", type=int, default=1000)
            part.add_argument("--chosen", action="store_true", help="motions of `ident plan`")
            part.add_argument("--verbose", action="store_true", help="say each refusal")
        if work is errors:
            part.add_argument("--seed", type=int, default=0, help="of the simulated arm")
            part.add_argument("--out", type=Path, default=Path("excitation-errors"))
            part.add_argument("--most-condition", type=float, help="that errors may cost")
            part.add_argument("--designed", type=Path, help="a design to use; else one is made")
            part.add_argument(
                "--published", type=Path, required=True, help="positions, 500 Hz, one period [rad]"
            )
    arguments = parser.parse_args()
    arguments.work(arguments)


if __name__ == "__main__":
    main()
