"""Whether an encoder behind the gears can show their backlash: one joint without weight.

Run: .venv/bin/python scripts/benchmarks/play_at_the_encoder.py FOLDER [--joint J] [--evals N]

Rotor and link of one joint of SAGE's SO-101, backlash between them, the encoder at the link, dry
friction at the rotor and, unless left out, at the link as well; the servo plans its motion with a
limited acceleration. CMA-ES fits all else to four motions with given half plays, with the known one
also where the link has no friction of its own, and with a free one. The torques share one factor
(no weight), so that the gain is given. Prints the rms of each motion.
"""

import argparse
from pathlib import Path

import cma
import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.floating]

MOTIONS = ("friction_gravity", "backlash_detection", "step_response", "slow_precision")
SPAN_S = (10.0, 40.0)
STEP_S = 2.5e-4
GAIN = 10.4
NAMES = (
    "damping", "rotor_friction", "link_friction", "rise", "rise_speed", "rotor", "link",
    "acceleration", "delay", "offset",
)  # fmt: skip
FIRST = np.array([0.65, 0.06, 0.03, 0.6, 0.07, 1e-3, 6e-3, 40.0, 0.003])
SPREAD = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.3, 1.0])


@njit(cache=True)
def simulated(t, command, start, p, half, out):
    """Positions of the link [rad] at each instant, commands held between samples."""
    damping, dry, link_dry, rise, pace_0, rotor, link, hard, delay, offset = p
    x, q, v, w, goal, pace, k, now = start, start, 0.0, 0.0, command[0], 0.0, 0, t[0]
    out[0], h = start, STEP_S
    for i in range(t.size - 1):
        while now < t[i + 1] - 1e-9:
            while k < t.size - 1 and t[k + 1] <= now - delay:
                k += 1
            far, short = command[k] - goal, 0.5 * hard * h
            stopping = np.sqrt(short * short + 2.0 * hard * abs(far)) - short
            fast = min(stopping, abs(far) / h)
            change = (fast if far > 0.0 else -fast) - pace
            pace += min(max(change, -hard * h), hard * h)
            goal += h * pace
            torque = GAIN * (goal - q) + offset
            if half > 0.0:
                twist = x - q
                beyond = twist - min(max(twist, -half), half)
                through = 0.0
                if beyond != 0.0:
                    through = 600.0 * beyond + 0.6 * (v - w)
                    through = through if through * beyond > 0.0 else 0.0
                level = h * dry * (1.0 + rise * np.exp(-((v / pace_0) ** 2)))
                m = rotor * v + h * (torque - through)
                v = (m - min(max(m, -level), level)) / (rotor + h * damping)
                x += h * v
                level = h * link_dry * (1.0 + rise * np.exp(-((w / pace_0) ** 2)))
                m = link * w + h * through
                w = (m - min(max(m, -level), level)) / link
            else:
                level = h * (dry + link_dry) * (1.0 + rise * np.exp(-((w / pace_0) ** 2)))
                m = (rotor + link) * w + h * torque
                w = (m - min(max(m, -level), level)) / (rotor + link + h * damping)
            q += h * w
            now += h
        out[i + 1] = q


def errors(tables: list[Array], p: Array, half: float) -> Array:
    """Rms of each motion after two seconds [rad]."""
    rms = []
    for t, command, q in tables:
        out = np.empty(t.size)
        simulated(t, command, q[0], p, half, out)
        rms.append(np.sqrt(np.mean((q - out)[100:] ** 2)))
    return np.nan_to_num(np.array(rms), nan=1.0)


def searched(tables: list[Array], half: float | None, *, held: bool, evals: int) -> None:
    """Print the best that CMA-ES finds; `held`: the link has friction of its own."""

    def placed(y: Array) -> tuple[Array, float]:
        p = np.append(FIRST * np.exp(SPREAD * y[: len(FIRST)]), 0.1 * y[len(FIRST)])
        p[2] *= held
        return p, 0.005 * np.exp(np.clip(y[-1], -4.0, 1.5)) if half is None else half

    def cost(y: Array) -> float:
        return float(np.log(errors(tables, *placed(y))).sum() + 1e-3 * y @ y)

    count = len(FIRST) + 1 + (half is None)
    options = {"seed": 3, "verbose": -9, "maxfevals": evals}
    search = cma.CMAEvolutionStrategy([0.0] * count, 0.5, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, [cost(np.array(y)) for y in asked])
    p, play = placed(search.result.xbest)
    rms = " ".join(f"{1e3 * x:5.2f}" for x in errors(tables, p, play))
    what = ", ".join(f"{n} {x:.3g}" for n, x in zip(NAMES, p, strict=True))
    print(
        f"half play {1e3 * play:5.2f} mrad, cost {search.result.fbest:7.2f}, rms {rms} mrad; {what}"
    )


def main() -> None:
    """Print a line for each assumption."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--joint", default="Rotation")
    parser.add_argument("--half-play", type=float, nargs="*", help="mrad")
    parser.add_argument("--evals", type=int, default=1200)
    asked, tables = parser.parse_args(), []
    for name in MOTIONS:
        rows = np.genfromtxt(asked.folder / f"{name}.csv", delimiter=",", names=True)
        columns = [rows["t_s"], rows[f"cmd_{asked.joint}"], rows[f"pos_{asked.joint}"]]
        inside = (columns[0] > SPAN_S[0]) & (columns[0] < SPAN_S[1])
        tables.append([np.ascontiguousarray(c[inside]) for c in columns])
    print("rms of", ", ".join(MOTIONS))
    for half in asked.half_play or [0.0, 4.0, 8.7, None]:
        for held in (True, False) if half and half > 8.0 else (True,):
            searched(tables, half and 1e-3 * half, held=held, evals=asked.evals)


if __name__ == "__main__":
    main()
