"""Blind benchmark of `ident gap`: arms and effects in forms that the tool does not know.

Run: .venv/bin/python scripts/benchmarks/gap_naming.py [--runs N] [--seed S] [--free]

Each run perturbs the arm's links and friction, draws for each joint how it turns round (stick,
Dahl, LuGre, slip, three sign shapes), hides one effect (or none with --free), records two periods
in closed loop, and searches. Seeds below 1000 are for development; the others are for scoring.
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from gap_effects import make
from gap_plants import DAHL, LUGRE, SLIP, Body, Hidden, Noise, record

from ident.arm import arm_from_file
from ident.gap.experiment import experiment
from ident.gap.uncertainty import finished
from ident.gap.verdict import Kind
from ident.gap.workflow import Options, Search, search
from wamctl.arm.config import load_arm_file, shipped_file
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters
from wamctl.arm.ros2.joint_series import ReferenceSeries
from wamctl.arm.trajectory import Trajectory, read_trajectory, reference, trajectory_yaml

PERIODS = 2
KINDS = 7  # ways of turning round, as gap_plants numbers them
PAIRS = ((1, 2), (4, 5))

# size in units of the joint's Coulomb friction where the second entry is true, else in SI
KNOWN = {
    "torque_offset": (0.5, True),
    "unequal_friction": (0.3, False),
    "joint_spring": (0.6, True),
    "stribeck": (0.7, True),
    "nonlinear_viscous": (0.5, True),
    "asymmetric_viscous": (0.4, True),
    "load_dependent_friction": (0.12, False),
    "coupled_friction": (0.5, True),
    "thermal_drift": (0.5, False),
    "gravity_tilt": (0.03, False),
    "encoder_offset": (0.04, False),
    "torque_gain": (0.06, False),
    "torque_delay": (0.006, False),
    "torque_ripple": (0.25, True),
    "contact": (6.0, False),
}
STRANGE = {
    "one_sided_stop": (3.0, True),
    "position_dependent_friction": (0.5, True),
    "other_period": (0.25, True),
    "cross_talk": (0.5, True),
    "periodic_in_time": (0.25, True),
    "hard_cubic_spring": (0.6, True),
}
NAMES = {"unequal_friction": "torque_offset"}  # exact equivalents have one name


@dataclass(frozen=True)
class Case:
    """What is hidden.

    Attributes:
        family: its name; empty for nothing.
        joints: from 0.
        size: in the family's unit.
    """

    family: str
    joints: tuple[int, ...]
    size: float

    @property
    def answer(self) -> str:
        """What the tool ought to say."""
        if not self.family:
            return "no_gap"
        return "unknown" if self.family in STRANGE else NAMES.get(self.family, self.family)


def draw(rng: np.random.Generator, coulomb: np.ndarray, free: bool, scale: float) -> Case:
    """One effect at one place."""
    if free:
        return Case("", (), 0.0)
    sizes = KNOWN | STRANGE
    family = str(rng.choice(list(sizes)))
    joint = int(rng.integers(0, 7))
    joints = PAIRS[int(rng.integers(0, 2))] if family.startswith("coupled") else (joint,)
    if family == "encoder_offset":
        joints = (int(rng.integers(1, 4)),)
    size, relative = sizes[family]
    size *= scale * float(np.exp(rng.uniform(-0.4, 0.4))) * (coulomb[joints[0]] if relative else 1)
    return Case(family, joints, size)


def recorded(rng: np.random.Generator, case: Case, seed: int) -> tuple[Recording, set[int]]:
    """Two periods of a perturbed arm with the effect, and which joints (from 0) have bristles."""
    file = load_arm_file("wam7.yaml")
    robot = arm_from_file(Path("wam7.yaml"), ()).robot
    excitation = read_trajectory("wam7-excitation.yaml")
    motion = reference(excitation.series, PERIODS, file.excitation.ramp_s, file.bus.period_s)
    coulomb = np.array(file.simulation.coulomb_nm) * np.exp(rng.uniform(-0.3, 0.3, 7))
    links = cad_parameters(robot).reshape(-1, 10) * (1 + rng.uniform(-0.08, 0.08, (7, 1)))
    kinds = rng.integers(0, KINDS, 7)
    widths = np.where(kinds <= 2, rng.uniform(1e-4, 6e-4, 7), rng.uniform(3e-3, 1.2e-2, 7))
    viscous = np.array(file.simulation.viscous_nm_s_rad) * np.exp(rng.uniform(-0.3, 0.3, 7))
    body = Body(links.ravel(), viscous, coulomb, kinds, widths)
    hidden = Hidden()
    if case.family:
        matrix = np.array(file.transmission.motor_from_joint)
        ranges = motion.q.min(axis=0), motion.q.max(axis=0)
        hidden = make(case.family, case.joints, case.size, rng, matrix, ranges)
    log = record(file, robot, body, hidden, Noise(2e-3 * coulomb, 0.05), motion, seed)
    inside = {
        "config.yaml": shipped_file("wam7.yaml").read_bytes(),
        "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
        "trajectory.yaml": trajectory_yaml(Trajectory(excitation.series, PERIODS, {}, {})).encode(),
    }
    series = ReferenceSeries(log.stamp_ns, motion.q, motion.qd, motion.qdd)
    bristles = {j for j in range(7) if kinds[j] in (DAHL, LUGRE, SLIP)}
    return replace(log, reference=series, attachments=inside), bristles


def said(found: Search) -> tuple[str, set[str], bool]:
    """Verdict, names (with rivals where ambiguous), and whether a name is held confidently."""
    verdict = found.verdict
    names = {f.hypothesis.effect for f in verdict.found}
    names |= {r.hypothesis.effect for f in verdict.found for r in f.rivals}
    names |= {"contact"} if verdict.burst is not None else set()
    return str(verdict.kind), names, verdict.kind == Kind.NAMED


def places(found: Search) -> set[int]:
    """Joints that the answer names, from 0."""
    named = {j for f in found.verdict.found for j in f.hypothesis.joints}
    return named | set(found.verdict.burst.joints if found.verdict.burst else ())


def right(case: Case, found: Search, bristles: set[int]) -> bool:
    """Whether family and joint are named, or rightly not.

    A joint that turns round on bristles has presliding: naming that too is no error.
    """
    kind, names, confident = said(found)
    sliding = {
        j
        for f in found.verdict.found
        if f.hypothesis.effect == "presliding"
        for j in f.hypothesis.joints
    }
    if sliding <= bristles:
        names = names - {"presliding"}
    if case.answer == "no_gap":
        return kind == "no_gap" or (kind == "named" and not names)
    if case.answer == "unknown":
        return kind == "unknown"
    if kind not in ("named", "ambiguous"):
        return False
    whole = case.family in ("gravity_tilt", "torque_delay", "contact")
    here = whole or bool(set(case.joints) & places(found))
    return case.answer in names and here and (not confident or names == {case.answer})


def main() -> None:
    """Print a line for each run, then the tables."""
    options = argparse.ArgumentParser()
    options.add_argument("--runs", type=int, default=10)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--null-runs", type=int, default=2)
    options.add_argument("--scale", type=float, default=1.0)
    options.add_argument("--free", action="store_true")
    chosen = options.parse_args()
    coulomb = np.array(load_arm_file("wam7.yaml").simulation.coulomb_nm)
    table: Counter[tuple[str, str]] = Counter()
    score: Counter[str] = Counter()
    for seed in range(chosen.seed, chosen.seed + chosen.runs):
        rng = np.random.default_rng(seed)
        case = draw(rng, coulomb, chosen.free, chosen.scale)
        try:
            log, bristles = recorded(rng, case, seed)
        except ValueError as error:
            print(f"{seed:5d} {case.family:28s} not recorded: {error}")
            continue
        began = time.perf_counter()
        found = search(
            experiment([log], ["log"]), Options(null_runs=chosen.null_runs), lambda _: None
        )
        kind, names, confident = said(found)
        good = right(case, found, bristles)
        wrong = confident and not good
        score.update({"runs": 1, "right": good, "wrong and confident": wrong})
        answer = kind if kind in ("no_gap", "unknown", "data_fault") else " + ".join(sorted(names))
        table[case.family or "nothing", answer] += 1
        values = [
            f"{name}={v.value:.3g}±{v.sd:.2g}"
            for effect in finished(found.rows, found.end).parameters
            for name, v in effect.items()
        ]
        joints = ",".join(str(j + 1) for j in case.joints)
        print(
            f"{seed:5d} {'ok ' if good else 'WRONG' if wrong else 'no '} {case.family:28s} joint"
            f" {joints:4s} size {case.size:.3g} -> {kind}: {answer} at"
            f" {sorted(j + 1 for j in places(found))} {' '.join(values[:4])}"
            f" ({time.perf_counter() - began:.0f} s)"
        )
        sys.stdout.flush()
    print("\nhidden -> said")
    for (truth, answer), count in sorted(table.items()):
        print(f"  {truth:28s} {answer:50s} {count}")
    for name, count in score.items():
        print(f"{name}: {count}")


if __name__ == "__main__":
    main()
