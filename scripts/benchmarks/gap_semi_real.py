"""Effects added by arithmetic to the torque of real recordings: does `ident gap` name them?

Run: .venv/bin/python scripts/benchmarks/gap_semi_real.py LOG.. [--seed S] [--level X]
     .venv/bin/python scripts/benchmarks/gap_semi_real.py LOG.. [--seed S] --detectable X

Each effect of the list is added once to each recording, at a random joint at which the recording
as it is shows no such effect; its rms is so many times the residual of that joint (`--level`), or
its size so many times the smallest one that the search calls detectable there (`--detectable`).
The motion stays as it was recorded. Prints what was named beside what is named without it.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from ident.gap.data.experiment import Experiment, read_experiment
from ident.gap.options import Options
from ident.gap.regression.weighted_fit import mean_squares
from ident.gap.results.minimum_detectable import minimum_detectable
from ident.gap.results.outcome import SearchResult
from ident.gap.search import search
from ident.recordings.dataset import in_memory

Array = NDArray[np.floating]

_SMOOTH_S = 0.25


def _springs(q: Array, qd: Array, qdd: Array) -> Array:
    return np.tanh(0.8 * (q - q.mean()))


def _low_speed(q: Array, qd: Array, qdd: Array) -> Array:
    width = 0.1 * np.abs(qd).max()
    return np.sign(qd) / (1.0 + (qd / width) ** 2)


def _square(q: Array, qd: Array, qdd: Array) -> Array:
    return qd * np.abs(qd)


def _one_way(q: Array, qd: Array, qdd: Array) -> Array:
    return np.maximum(qd, 0.0)


def _constant(q: Array, qd: Array, qdd: Array) -> Array:
    return np.ones_like(q)


def _rotor(q: Array, qd: Array, qdd: Array) -> Array:
    return qdd


def _linear(q: Array, qd: Array, qdd: Array) -> Array:
    return q - q.mean()


def _extra_at_rest(q: Array, qd: Array, qdd: Array) -> Array:
    return np.sign(qd) * np.exp(-((qd / (0.1 * np.abs(qd).max())) ** 2))


def _both_ways(q: Array, qd: Array, qdd: Array) -> Array:
    return np.abs(qd)


Shape = Callable[[Array, Array, Array], Array]

EFFECTS: dict[str, Shape] = {
    "joint_spring": _springs,
    "stribeck": _low_speed,
    "nonlinear_viscous": _square,
    "asymmetric_viscous": _one_way,
    "torque_offset": _constant,
    "rotor_inertia": _rotor,
}


OF_SIZE_ONE: dict[str, Shape] = {
    "joint_spring": _linear,
    "stribeck": _extra_at_rest,
    "asymmetric_viscous": _both_ways,
    "torque_offset": _constant,
    "rotor_inertia": _rotor,
}
"""Torque of effects whose first coefficient is one, in the unit that the search tells."""


def with_rms(source: Experiment, effect: str, joint: int, rms: float) -> Experiment:
    """The recordings with a torque of that rms [N m] added at a joint (from 0)."""

    def torque(*motion: Array) -> Array:
        shape = EFFECTS[effect](*motion)
        return rms * shape / np.sqrt(np.mean(shape**2))

    return with_torque(source, joint, torque)


def with_size(source: Experiment, effect: str, joint: int, size: float) -> Experiment:
    """The recordings with an effect of that first coefficient at a joint (from 0)."""
    return with_torque(source, joint, lambda *motion: size * OF_SIZE_ONE[effect](*motion))


def with_torque(source: Experiment, joint: int, added: Shape) -> Experiment:
    """The recordings with a torque of the motion [N m] added at a joint (from 0)."""
    data = []
    for d in source.datasets:
        segments = []
        for s in d.segments:
            width = max(5, 2 * round(_SMOOTH_S * d.rate_hz / 2) + 1)
            motion = [
                savgol_filter(s.q[:, joint], width, 3, deriv=k, delta=1 / d.rate_hz)
                for k in range(3)
            ]
            tau = s.tau.copy()
            tau[:, joint] += added(motion[0], motion[1], motion[2])
            segments.append(replace(s, tau=tau))
        data.append(in_memory(d, d.rate_hz, segments))
    return replace(source, datasets=tuple(data))


def named(found: SearchResult) -> set[tuple[str, int]]:
    """Effects with their joints, from 1."""
    return {(f.candidate.effect, j + 1) for f in found.verdict.effects for j in f.candidate.joints}


def rivals(found: SearchResult) -> set[tuple[str, int]]:
    """What could not be told from the named ones."""
    return {
        (r.candidate.effect, j + 1)
        for f in found.verdict.effects
        for r in f.rivals
        for j in r.candidate.joints
    }


def main() -> None:
    """Print a line for each effect and recording, and the sums."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("logs", type=Path, nargs="+")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--level", type=float, default=1.0)
    options.add_argument("--detectable", type=float, default=None)
    chosen = options.parse_args()
    rng = np.random.default_rng(chosen.seed)
    counts = {"named": 0, "rival of another": 0, "missed": 0}
    for path in chosen.logs:
        source = read_experiment([path])
        before = search(source, Options(), lambda _: None)
        there = named(before)
        print(f"{path.stem} as it is: {before.verdict.kind}, {sorted(there)}", flush=True)
        noise = np.sqrt(mean_squares(before.end.fit))
        least = minimum_detectable(before).sizes
        for effect in EFFECTS if chosen.detectable is None else OF_SIZE_ONE:
            free = [j for j in np.flatnonzero(source.moving) if (effect, j + 1) not in there]
            if chosen.detectable is not None:
                free = [j for j in free if j in least.get(effect, {})]
            if not free:
                continue
            joint = int(rng.choice(free))
            if chosen.detectable is None:
                changed = with_rms(source, effect, joint, chosen.level * float(noise[joint]))
            else:
                size = chosen.detectable * least[effect][joint]
                changed = with_size(source, effect, joint, size)
            after = search(changed, Options(), lambda _: None)
            place = (effect, joint + 1)
            what = "named" if place in named(after) else "missed"
            what = "rival of another" if what == "missed" and place in rivals(after) else what
            counts[what] += 1
            fresh = sorted(named(after) - there)
            print(f"  {effect} at {joint + 1}: {what} ({after.verdict.kind}; new: {fresh})")
    print(", ".join(f"{k} {v}" for k, v in counts.items()))


if __name__ == "__main__":
    main()
