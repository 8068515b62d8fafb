"""Whether arms that are healthy, but not as the model has them, are stopped; and by how much not.

Usage: scripts/benchmarks/false_stops.py [CONFIG [CASE...]], from the root, with .venv's Python.
For each case an arm that carries effects in secret runs a period of the shipped motion in lockstep.
Prints how it ended, and per motor the largest torque that the motion did not show, beside its limit
`safety.unaccounted_torque_nm` [N m, motor side].
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from served_arm import program, served

from wamctl.arm.config import find_file, load_arm_file
from wamctl.arm.recording import read_recording
from wamctl.experiment.preflight import load_arm
from wamctl.safety.state_estimator import ArmState
from wamctl.safety.torque_residual import TorqueResidual

ALL = [1, 2, 3, 4, 5, 6, 7]
TRUTH = load_arm_file("wam7.yaml").simulation
COULOMB = np.array(TRUTH.coulomb_nm if TRUTH else [])
VISCOUS = np.array(TRUTH.viscous_nm_s_rad if TRUTH else [])
RATIO = np.array([42, 28, 17, 18, 9.7, 9.7, 15])
RELEASE_S = 1.0
Effect = dict[str, object]


def on_all(effect: str, key: str, sizes: np.ndarray, **more: object) -> Effect:
    """An effect with a size for each joint."""
    return {"effect": effect, "joints": ALL, key: np.round(sizes, 6).tolist(), **more}


CASES: dict[str, list[Effect]] = {
    "nothing": [],
    "stribeck": [on_all("stribeck", "extra_nm", 0.95 * COULOMB, speed_rad_s=0.05)],
    "presliding": [
        on_all(
            "presliding",
            "stiffness_nm_rad",
            400 * COULOMB,
            form="lugre",
            damping_nm_s_rad=COULOMB.tolist(),
            extra_nm=(0.4 * COULOMB).tolist(),
        )
    ],
    "more friction": [
        on_all("nonlinear_viscous", "quadratic_nm_s2_rad2", 0.7 * COULOMB),
        {"effect": "load_dependent_friction", "joints": ALL, "share": 0.16},
        {"effect": "thermal_drift", "joints": ALL, "share": 0.7, "time_constant_s": 20},
    ],
    "offset": [on_all("torque_offset", "nm", 0.7 * COULOMB)],
    "asymmetry": [on_all("asymmetric_viscous", "nm_s_rad", 0.4 * VISCOUS)],
    "payload": [{"effect": "payload", "kg": 0.8}],
    "body": [
        {"effect": "gravity_tilt", "x_rad": 0.04},
        {"effect": "encoder_offset", "joints": [2], "rad": 0.05},
        on_all("rotor_inertia", "kg_m2", 0.03 * COULOMB),
        on_all("joint_spring", "nm_rad", 0.6 * COULOMB),
    ],
    "gain": [{"effect": "torque_gain", "joints": ALL, "factor": 0.92}],
    "delay": [{"effect": "torque_delay", "joints": [1, 2, 3, 4], "seconds": 0.006}],
    "ripple": [on_all("torque_ripple", "nm", 0.3 * COULOMB / RATIO)],
    "elasticity": [{"effect": "joint_elasticity", "joints": [1, 2, 3, 4], "nm_rad": 20000}],
    "backlash": [{"effect": "backlash", "joints": ALL, "rad": 0.003}],
    "contact": [
        {"effect": "contact", "joints": [2], "nm": 8, "from_s": 12, "to_s": 12.5},
        {"effect": "contact", "joints": [4], "nm": -8, "from_s": 16, "to_s": 16.5},
    ],
    "dropped samples": [{"effect": "dropped_samples", "share": 0.02}],
    "strangers": [
        {"effect": "slosh", "joints": [2], "kg_m2": 0.05, "hz": 3},
        {"effect": "damaged_tooth", "joints": [2], "nm": 2, "at_rad": 0.0},
        {"effect": "vibration", "joints": [2], "nm": 2, "hz": 8},
        {"effect": "hose", "joints": [4], "nm": 2},
    ],
}


def configuration(shipped: str, folder: Path) -> Path:
    """A shipped arm with one period of its motion."""
    content = yaml.safe_load(find_file(shipped).read_text())
    content["robot"]["urdf"] = str(find_file(content["robot"]["urdf"]))
    if "dictionary" in content["drives"]:
        content["drives"]["dictionary"] = str(find_file(content["drives"]["dictionary"]))
    motion = yaml.safe_load(find_file(content["excitation"]["trajectory"]).read_text())
    (folder / "motion.yaml").write_text(yaml.safe_dump(motion | {"periods": 1}))
    content["excitation"] |= {"trajectory": "motion.yaml", "ramp_s": 2.0}
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def run(config: Path, effects: list[Effect]) -> tuple[str, np.ndarray]:
    """How it ended, and the largest torque left over per motor [N m], shape (n,)."""
    log, bus = config.with_name("log.mcap"), f"simbus:{config.with_name('bus')}"
    log.unlink(missing_ok=True)
    arm = load_arm(str(config))[1]
    excite = [program("wamctl"), "excite", "--config", str(config), "--bus", bus, "--lockstep"]
    excite += ["--yes-move-the-arm", arm.file.arm, "--out", str(log)]
    hidden = config.with_name("hidden.yaml")
    hidden.write_text(yaml.safe_dump({"effects": effects}))
    with served(config, bus, "--lockstep", "--hidden", str(hidden)):
        done = subprocess.run(excite, capture_output=True, text=True, check=False)
    last = done.stderr.strip().splitlines()[-1] if done.returncode else "to its end"
    recording = read_recording(log)
    tau = recording.command.effort if recording.command else np.zeros_like(recording.q)
    seconds = recording.stamp_ns * 1e-9
    residual = TorqueResidual(arm.robot, arm.transmission, arm.file.controller.velocity_cutoff_hz)
    driven = np.flatnonzero(np.abs(tau).sum(axis=1))
    end = seconds[driven[-1]] - (0.0 if done.returncode else RELEASE_S)
    left = [
        residual.update(
            ArmState(recording.q[k], recording.qd[k], recording.q[k], complete=True),
            tau[k - 1],
            seconds[k] - seconds[k - 1],
        )
        for k in range(driven[0] + 1, int(np.searchsorted(seconds, end)))
    ]
    return last, np.abs(left).max(axis=0)


def main() -> None:
    """The table."""
    shipped = sys.argv[1] if len(sys.argv) > 1 else "wam7.yaml"
    with tempfile.TemporaryDirectory() as folder:
        config = configuration(shipped, Path(folder))
        limit = load_arm_file(config).safety.unaccounted_torque_nm
        print(f"| hidden | {' | '.join(f'{nm:g}' for nm in limit)} | ended |")
        print("| --- " * (len(limit) + 2) + "|")
        for name in sys.argv[2:] or list(CASES):
            ended, left = run(config, CASES[name])
            print(f"| {name} | {' | '.join(f'{nm:.3f}' for nm in left)} | {ended} |", flush=True)


if __name__ == "__main__":
    main()
