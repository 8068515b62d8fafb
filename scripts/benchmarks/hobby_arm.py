"""Replay errors of the SO-101's recordings: `ident run --method simulation` beside MuJoCo's own.

Run: .venv/bin/python scripts/benchmarks/hobby_arm.py FOLDER [--seconds S] [--against ROW ...]

FOLDER holds the tables and `so101_new_calib.xml`. Five motions are fitted, the others judged.
Beside the tool: the published MJCF (both published gains) with the best zero and gain of each
joint, and with all of MuJoCo's own parameters of a joint (gain, damping, friction, rotor, force
limit, zero), each found by CMA-ES in the tool's computing time (`--seconds` sets another). CMA-ES
sees every fourth piece of 8 s, which makes it four times as fast. Times are of one processor.
"""

import argparse
import itertools
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import cma
import mujoco
import numpy as np
from numpy.typing import NDArray

import ident
from ident.importers.recording import import_recording
from ident.output_error.fit import Stretch
from ident.output_error.recordings import pieces, stretches_of
from ident.output_error.servo_model import write_servo_model

Array = NDArray[np.floating]

FITTED = (
    "chirp_sweep", "friction_gravity", "backlash_detection", "step_response", "random_waypoints",
)  # fmt: skip
TIMESTEP_S = 0.002
OWN = (0.60, 0.052, 0.028, 3.35)  # damping, frictionloss, armature, force limit as published
GAINS = {"old": (17.8, 0.0), "new": (998.22, 2.731)}  # kp, kv


def replayed(arm: mujoco.MjModel, zero: Array, stretch: Stretch) -> Array:
    """Positions of the MJCF along a recording's commands [rad], shape (S, n)."""
    motion, state = stretch.motion, mujoco.MjData(arm)
    state.qpos[:], state.qvel[:] = motion.start + zero, motion.speed
    held = np.maximum(np.searchsorted(motion.stamp, motion.t, side="right") - 1, 0)
    wanted, read = motion.command[held] + zero, np.empty_like(stretch.q)
    for k in range(len(read)):
        read[k] = state.qpos
        span = motion.t[min(k + 1, len(read) - 1)] - motion.t[k]
        state.ctrl[:] = wanted[k]
        mujoco.mj_step(arm, state, nstep=max(round(span / TIMESTEP_S), 1))
    return read - zero


def residuals(arm: mujoco.MjModel, zero: Array, stretches: Sequence[Stretch]) -> Array:
    """Measured less replayed positions [rad], shape (S, n)."""
    left = [(s.q - replayed(arm, zero, s))[s.counted :] for s in stretches]
    return np.nan_to_num(np.concatenate(left), nan=1.0)


def with_values(arm: mujoco.MjModel, kp: Array, kv: float, own: Array) -> None:
    """Set gains, and damping, friction, rotor, force limit, shape (4, n)."""
    arm.actuator_gainprm[:, 0], arm.actuator_biasprm[:, 1] = kp, -kp
    arm.actuator_biasprm[:, 2] = -kv
    arm.dof_damping[:], arm.dof_frictionloss[:], arm.dof_armature[:] = own[:3]
    arm.actuator_forcerange[:] = np.stack([-own[3], own[3]], axis=1)


def searched(cost: Callable[[Array], float], start: Array, seconds: float, seed: int) -> Array:
    """The best of CMA-ES in so much processor time."""
    search = cma.CMAEvolutionStrategy(
        start.tolist(), 0.3, {"seed": seed, "verbose": -9, "tolfun": 1e-9}
    )
    until = time.process_time() + seconds
    while time.process_time() < until and not search.stop():
        asked = search.ask()
        search.tell(asked, [cost(np.array(x)) for x in asked])
    return np.array(search.result.xbest)


def mjcf_error(
    folder: Path, kind: str, fitted: Sequence[Stretch], judged: Sequence[Stretch], all_own: bool,
    seconds: float, seed: int,
) -> Array:  # fmt: skip
    """Rms on the judged recordings of the published MJCF with what CMA-ES finds [rad]."""
    arm = mujoco.MjModel.from_xml_path(str(folder / "so101_new_calib.xml"))
    arm.opt.timestep, arm.opt.integrator = TIMESTEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    (kp, kv), n = GAINS[kind], arm.nu

    def placed(x: Array) -> Array:
        """Gain and zero of each joint, then the logarithms of its own four."""
        rows = x.reshape(-1, n)
        factor = np.exp(rows[2:]) if all_own else np.ones((4, n))
        with_values(arm, kp * np.exp(rows[0]), kv, np.array(OWN)[:, None] * factor)
        return 0.3 * rows[1]

    def cost(x: Array) -> float:
        left = residuals(arm, placed(x), fitted)
        return float(np.log(np.mean(left**2, axis=0)).sum())

    best = searched(cost, np.zeros((6 if all_own else 2) * n), seconds, seed)
    return np.sqrt(np.mean(residuals(arm, placed(best), judged) ** 2, axis=0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--seed", type=int, default=1)
    rows = [f"{kind}-{what}" for what, kind in itertools.product(("gains", "all"), GAINS)]
    parser.add_argument("--against", nargs="*", choices=rows, default=rows)
    parser.add_argument("--model", type=Path, help="where to keep the tool's model")
    asked = parser.parse_args()
    arm, recordings = ident.Arm.from_config("so101.yaml"), {}
    with tempfile.TemporaryDirectory() as folder:
        for table in sorted(asked.folder.glob("*.csv")):
            log = Path(folder) / f"{table.stem}.mcap"
            import_recording(table, "so101-map.yaml", log)
            recordings[table.stem] = ident.Recording.from_bag(log)
    names = next(iter(recordings.values())).joints
    parts = {k: stretches_of(r.log, names, k) for k, r in recordings.items()}
    fitted = [s for k in FITTED for s in parts[k]]
    judged = [s for k in parts if k not in FITTED for s in parts[k]]
    start = time.process_time()
    found = ident.identify(arm, [recordings[k] for k in FITTED], method="simulation")
    spent = time.process_time() - start
    if asked.model:
        write_servo_model(asked.model, found.model)
    left = np.concatenate([s.q - found.model.replay(s) for s in judged])
    print("rms [mrad] by joint, and of all, on recordings that were not fitted")
    row(f"ident, {spent:.0f} s", np.sqrt(np.mean(left**2, axis=0)))
    seconds = asked.seconds or spent
    thin = [p for s in fitted for p in pieces([s], max(round(s.motion.t[-1] / 8), 1))][::4]
    for against in asked.against:
        kind, what = against.split("-")
        args = asked.folder, kind, thin, judged, what == "all", seconds, asked.seed
        row(f"MJCF, {against}, {seconds:.0f} s", mjcf_error(*args))


def row(name: str, rms: Array) -> None:
    """Print a line of the table."""
    joints = " ".join(f"{1e3 * x:6.2f}" for x in rms)
    print(f"{name:44s} {joints}   {1e3 * np.sqrt(np.mean(rms**2)):6.2f}", flush=True)


if __name__ == "__main__":
    main()
