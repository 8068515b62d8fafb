"""The arm changed while the operator is asked: is every motion of before refused?

Usage: scripts/benchmarks/stale_pose.py [TIMES], from the root, with .venv's Python; 100 without it.

Each time, a random one of these happens while the prompt of `wamctl excite` waits: a joint is moved
by hand by 0.04 to 1 rad; an encoder's zero shifts by the motor counts of such a joint angle; a
drive restarts. A pose is refused with exit code 5, a drive with 4; no drive may have been enabled.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import can
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from sim_bus.assembly import load_simulation
from sim_bus.can_bus.hubs import open_hub
from sim_bus.server import Lockstep
from tests.bus.canopen.conftest import ServedArm, Witness, configuration
from tests.bus.serving import served_by_thread
from wamctl.arm.config import BusSection
from wamctl.drives.bus import open_bus, parse_channel

RESTART = 0x81


def changed(arm: ServedArm, rng: np.random.Generator) -> str:
    """What happens to the arm, in words."""
    plant, encoders = arm.simulation.arm.plant, arm.simulation.arm.encoders
    joint = int(rng.integers(7))
    by_rad = float(rng.choice([-1, 1]) * rng.uniform(0.04, 1.0))
    kind = str(rng.choice(["moved", "shifted", "restarted"]))
    if kind == "moved":
        plant.q[joint] += by_rad
    elif kind == "shifted":
        matrix = arm.simulation.truth.motor_from_joint[:, joint]
        motor = int(np.abs(matrix).argmax())
        turn = matrix[motor] * by_rad / (2.0 * np.pi)
        encoders.jump(motor, round(4096 * turn))
    else:
        with open_bus(parse_channel(arm.word), BusSection(channel=arm.word)) as bus:
            data = bytes((RESTART, joint + 1))
            bus.send(can.Message(arbitration_id=0, is_extended_id=False, data=data))
            bus.recv(0.2)
    return kind


def main() -> int:
    """Counts how each ended."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    ends: Counter[str] = Counter()
    refused = 0
    for k in range(times):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            path, word = configuration(folder), f"simbus:{folder / 'socket'}"
            simulation = load_simulation(path, k)
            arm = ServedArm(word, path, simulation, Witness(simulation.arm, simulation), [])
            hub = open_hub(word, fd=False)
            service = Lockstep(arm.witness, hub, simulation.period_ns, simulation.schedule)
            kinds: list[str] = []
            rng = np.random.default_rng(k)
            with served_by_thread(service, hub):
                done = arm.excite(
                    confirm=lambda _, a=arm, r=rng, said=kinds: said.append(changed(a, r))
                )
            code = getattr(done.error, "exit_code", 0)
            moved = any(any(torques) for _, torques in arm.witness.torques)
            ends[f"{kinds[0]}, exit {code}{', moved' if moved else ''}"] += 1
            refused += code == (4 if kinds[0] == "restarted" else 5) and not moved
    print(f"{refused} of {times} refused: {dict(ends)}")
    return int(refused < times)


if __name__ == "__main__":
    sys.exit(main())
