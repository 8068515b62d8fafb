"""Replay errors of the SO-101's recordings: `ident run --method simulation` beside MuJoCo's own.

Run: .venv/bin/python scripts/benchmarks/hobby_arm.py FOLDER [--fitted MOTION ...] [--seconds S]
[--against ROW ...]

FOLDER holds the tables and `so101_new_calib.xml`. Five motions are fitted, the others judged.
Beside the tool: the published MJCF (old and new published gains) with the best zero and gain of
each joint (`gains`, by `mujoco.sysid`), and with all of its own parameters of a joint (gain,
damping, friction, rotor, force limit, zero), found by CMA-ES (`cma`) or by MuJoCo's own library
(`sysid`), in the tool's processor time (`--seconds` sets another). They minimise what is judged, on
every fourth piece of 8 s, which makes them four times as fast. A gain on speed would be damping
once more, and a delay comes out below 3 ms with the tool. `pip install cma 'mujoco[sysid]'`.
"""

import argparse
import io
import itertools
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import cma
import mujoco
import numpy as np
from mujoco import sysid
from numpy.typing import NDArray

import ident
from ident.importers.recording import import_recording
from ident.output_error.recordings import pieces, segments_of
from ident.output_error.servo_model import read_servo_model
from ident.output_error.setup import MotionSegment

Array = NDArray[np.floating]

FITTED = (
    "chirp_sweep", "friction_gravity", "backlash_detection", "step_response", "random_waypoints",
)  # fmt: skip
TIMESTEP_S = 0.004  # 0.5 ms instead moves the joints by 0.6 mrad at most
OWN = (0.60, 0.052, 0.028, 3.35)  # damping, frictionloss, armature, force limit as published
GAINS = {"old": (17.8, 0.0), "new": (998.22, 2.731)}  # kp, kv


def replayed(arm: mujoco.MjModel, zero: Array, segment: MotionSegment) -> Array:
    """Positions of the MJCF along a recording's commands [rad], shape (S, n)."""
    motion, state = segment.motion, mujoco.MjData(arm)
    state.qpos[:], state.qvel[:] = motion.start + zero, motion.speed
    held = np.maximum(np.searchsorted(motion.stamp, motion.t, side="right") - 1, 0)
    wanted, read = motion.command[held] + zero, np.empty_like(segment.q)
    for k in range(len(read)):
        read[k] = state.qpos
        span = motion.t[min(k + 1, len(read) - 1)] - motion.t[k]
        state.ctrl[:] = wanted[k]
        mujoco.mj_step(arm, state, nstep=max(round(span / TIMESTEP_S), 1))
    return read - zero


def residuals(arm: mujoco.MjModel, zero: Array, segments: Sequence[MotionSegment]) -> Array:
    """Measured less replayed positions [rad], shape (S, n)."""
    left = [(s.q - replayed(arm, zero, s))[s.counted :] for s in segments]
    return np.nan_to_num(np.concatenate(left), nan=1.0)


def with_values(arm: mujoco.MjModel, kp: Array, kv: float, own: Array) -> None:
    """Set gains, and damping, friction, rotor, force limit, shape (4, n)."""
    arm.actuator_gainprm[:, 0], arm.actuator_biasprm[:, 1] = kp, -kp
    arm.actuator_biasprm[:, 2] = -kv
    arm.dof_damping[:], arm.dof_frictionloss[:], arm.dof_armature[:] = own[:3]
    arm.actuator_forcerange[:] = np.stack([-own[3], own[3]], axis=1)


class SpentError(Exception):
    """The time is over."""


class Search:
    """Residuals at places of a search, and the best place, until a processor time has passed."""

    def __init__(self, left: Callable[[Array], Array], start: Array, seconds: float) -> None:
        self.left, self.start = left, start
        self.until = time.process_time() + seconds
        self.best, self.least, self.asked = start, np.inf, 0

    def at(self, place: Array) -> Array:
        """The residuals, shape (N,).

        Raises:
            SpentError: the time is over.
        """
        if time.process_time() > self.until:
            raise SpentError
        left = self.left(place).ravel()
        self.asked += 1
        if (cost := float(np.mean(left**2))) < self.least:
            self.best, self.least = place.copy(), cost
        return left

    def by_cma(self, seed: int) -> None:
        """Covariance matrix adaptation; again from its best place where it ends early."""
        while True:
            options = {"seed": seed, "verbose": -9, "tolfun": 1e-9}
            search = cma.CMAEvolutionStrategy(self.best.tolist(), 0.3, options)
            while not search.stop():
                asked = search.ask()
                search.tell(asked, [np.log(np.mean(self.at(np.array(x)) ** 2)) for x in asked])
            seed += 1

    def by_sysid(self) -> None:
        """Gauss-Newton of `mujoco.sysid`, differences of a thousandth."""
        wide = np.full(len(self.start), 5.0)
        own = sysid.ParameterDict()
        own.add(sysid.Parameter("own", self.start, -wide, wide))

        def asked(places: Array, _: sysid.ParameterDict) -> tuple[list[Array], list, list]:
            if places.ndim == 1:
                return [self.at(places)], [], []
            return [np.stack([self.at(place) for place in places.T], axis=1)], [], []

        sysid.optimize(own, asked, max_iters=1000, eps=1e-3, output=io.StringIO())


def mjcf_error(
    folder: Path, row_name: str, fitted: Sequence[MotionSegment], judged: Sequence[MotionSegment],
    seconds: float, seed: int,
) -> tuple[Array, str]:  # fmt: skip
    """Rms on the judged recordings of the published MJCF with what is found [rad], and a note."""
    kind, what = row_name.split("-")
    arm = mujoco.MjModel.from_xml_path(str(folder / "so101_new_calib.xml"))
    arm.opt.timestep, arm.opt.integrator = TIMESTEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    (kp, kv), n = GAINS[kind], arm.nu

    def placed(x: Array) -> Array:
        """Gain and zero of each joint, then the logarithms of its own four."""
        rows = x.reshape(-1, n)
        factor = np.ones((4, n)) if what == "gains" else np.exp(rows[2:])
        with_values(arm, kp * np.exp(rows[0]), kv, np.array(OWN)[:, None] * factor)
        return 0.3 * rows[1]

    start = np.zeros((2 if what == "gains" else 6) * n)
    search = Search(lambda x: residuals(arm, placed(x), fitted), start, seconds)
    note = "it has ended itself"
    try:
        search.by_cma(seed) if what == "cma" else search.by_sysid()
    except SpentError:
        note = "the time is over"
    rms = np.sqrt(np.mean(residuals(arm, placed(search.best), judged) ** 2, axis=0))
    return rms, f"{search.asked} simulations, fitted {1e3 * search.least**0.5:.2f}, {note}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fitted", nargs="+", default=FITTED, help="motions to fit")
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--seed", type=int, default=1)
    rows = [f"{kind}-{how}" for how, kind in itertools.product(("gains", "cma", "sysid"), GAINS)]
    parser.add_argument("--against", nargs="*", choices=rows, default=rows)
    parser.add_argument("--model", type=Path, help="where to keep the tool's model")
    parser.add_argument("--judge", type=Path, help="a model that was kept, instead of a fit")
    asked = parser.parse_args()
    arm, recordings = ident.Arm.from_config("so101.yaml"), {}
    with tempfile.TemporaryDirectory() as folder:
        for table in sorted(asked.folder.glob("*.csv")):
            log = Path(folder) / f"{table.stem}.mcap"
            import_recording(table, "so101-map.yaml", log)
            recordings[table.stem] = ident.Recording.from_bag(log)
    names = next(iter(recordings.values())).joints
    parts = {k: segments_of(r.log, names, k) for k, r in recordings.items()}
    fitted = [s for k in asked.fitted for s in parts[k]]
    judged = [s for k in parts if k not in asked.fitted for s in parts[k]]
    start = time.process_time()
    if asked.judge:
        model = read_servo_model(asked.judge)
    else:
        told = [recordings[k] for k in asked.fitted]
        model = ident.identify(arm, told, method="simulation").model
    spent = time.process_time() - start
    if asked.model:
        model.save(asked.model)
    left = np.concatenate([s.q - model.replay(s) for s in judged])
    print("rms [mrad] by joint, and of all, on recordings that were not fitted")
    row(f"ident, {spent:.0f} s", np.sqrt(np.mean(left**2, axis=0)))
    seconds = asked.seconds or spent
    thin = [p for s in fitted for p in pieces([s], max(round(s.motion.t[-1] / 8), 1))][::4]
    for against in asked.against:
        rms, note = mjcf_error(asked.folder, against, thin, judged, seconds, asked.seed)
        row(f"MJCF, {against}, {seconds:.0f} s", rms, note)


def row(name: str, rms: Array, note: str = "") -> None:
    """Print a line of the table."""
    joints = " ".join(f"{1e3 * x:6.2f}" for x in rms)
    print(f"{name:30s} {joints}   {1e3 * np.sqrt(np.mean(rms**2)):6.2f}  {note}", flush=True)


if __name__ == "__main__":
    main()
