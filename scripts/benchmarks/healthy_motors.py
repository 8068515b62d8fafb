"""Whether the test of the motors lets healthy arms pass with friction and gears of their own.

Usage: scripts/benchmarks/healthy_motors.py [--first N] [--seeds N] [--cases C...], from the root,
with .venv's Python.

The arms of `false_stops.py`, and for each seed one whose effects are drawn at random: presliding,
backlash, a Stribeck effect, elasticity, ripple and load-dependent friction of all joints, each with
a chance of one half, and a tool of up to 0.8 kg. Each runs on both protocols, in lockstep in one
process, up to its approach. Prints what stopped it, and how far a joint went from where it was.
"""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np
import yaml
from false_stops import ALL, CASES, COULOMB, RATIO, Effect, configuration, on_all
from fault_witness import Witness
from one_process import set_up

from sim_bus.assembly import load_simulation
from wamctl.arm.errors import UserError
from wamctl.experiment.preflight import Prepared, prepare
from wamctl.telemetry.status import Phase

SHIPPED = ("wam7.yaml", "wam7-classic.yaml")


class Passed(Exception):  # noqa: N818 - it is no error
    """The motors are tested."""


def drawn(seed: int) -> list[Effect]:
    """Effects of a healthy arm."""
    rng = np.random.default_rng([seed, 26])
    some = rng.uniform(0.3, 1.0, 7)
    slips_rad = np.exp(rng.uniform(np.log(1e-4), np.log(3e-3)))
    may: list[Effect] = [
        on_all(
            "presliding",
            "stiffness_nm_rad",
            COULOMB / slips_rad,
            form=str(rng.choice(["dahl", "lugre"])),
            extra_nm=(rng.uniform(0.0, 0.5) * COULOMB).tolist(),
            damping_nm_s_rad=(0.5 * COULOMB).tolist(),
        ),
        on_all("backlash", "rad", rng.uniform(0.0003, 0.003) * some),
        on_all("stribeck", "extra_nm", COULOMB * some, speed_rad_s=float(rng.uniform(0.03, 0.2))),
        {"effect": "joint_elasticity", "joints": ALL[:4], "nm_rad": float(rng.uniform(5e3, 3e4))},
        on_all("torque_ripple", "nm", 0.3 * COULOMB / RATIO * some),
        {
            "effect": "load_dependent_friction",
            "joints": ALL,
            "share": float(rng.uniform(0.02, 0.1)),
        },
    ]
    effects = [effect for effect in may if rng.random() < 0.5]
    if rng.random() < 0.5:
        effects.append({"effect": "payload", "kg": float(rng.uniform(0.1, 0.8))})
    return effects


def tested(prepared: Prepared, config: Path, effects: list[Effect], seed: int) -> tuple[str, float]:
    """What the test of the motors says of an arm, and how far a joint went meanwhile [rad]."""
    hidden = config.with_name("hidden.yaml")
    hidden.write_text(yaml.safe_dump({"effects": effects}))
    simulation = load_simulation(config, seed, hidden if effects else None)
    simulation.arm.plant.warm_up()
    away = [0.0]
    with set_up(prepared, config, simulation, Witness(simulation.arm, simulation)) as rig:

        def before_cycle() -> None:
            if rig.loop.phase == Phase.TEST:
                away.append(float(np.abs(rig.loop.state.q - rig.motion.approach.q[0]).max()))
            if rig.loop.phase == Phase.EXCITE:
                rig.bus.before_cycle = lambda: None
                raise Passed

        rig.bus.before_cycle = before_cycle
        try:
            rig.run()
        except Passed:
            return "passed", max(away)
        except UserError as error:
            return str(error), max(away)
    return "passed", max(away)


def main() -> None:
    """A line for each arm that is refused, and how many passed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--cases", nargs="*", default=list(CASES))
    parser.add_argument("--verbose", action="store_true")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.seeds)
    arms = [(name, CASES[name], 0) for name in asked.cases]
    arms += [(f"seed {seed}", drawn(seed), seed) for seed in seeds]
    passed = 0
    with tempfile.TemporaryDirectory() as box:
        for shipped in SHIPPED:
            folder = Path(box) / shipped
            folder.mkdir()
            config = configuration(shipped, folder)
            prepared = prepare(config)
            for name, effects, seed in arms:
                found, away = tested(prepared, config, effects, seed)
                passed += found == "passed"
                if asked.verbose or found != "passed":
                    what = ", ".join(str(effect["effect"]) for effect in effects)
                    print(f"{shipped} {name} ({what}): {away:.4f} rad, {found}", flush=True)
    total = 2 * len(arms)
    print(f"{passed} of {total} passed, {sum(os.times()[:4]) / total:.2f} s of a core each")


if __name__ == "__main__":
    main()
