"""How surely the weight that the motors hold tells a wrong scale, and how often a healthy arm's.

Usage: scripts/benchmarks/held_weight.py [ARMS], from the root, with .venv's Python. Torques that
hold the shipped arm in its resting pose, and there and at the start of the shipped motion, of arms
whose links differ from CAD as the simulated arm's do, with normal noise of 1 % of the expected
friction; 200 arms without a number. Counts scales that are told of the right motor.
"""

import sys

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sim_bus.plant.truth import draw_truth
from wamctl.arm.robot import with_parameters
from wamctl.arm.trajectory_check import expected_friction
from wamctl.experiment.loop import Arm
from wamctl.experiment.preflight import prepare
from wamctl.safety.held_weight import Explanation, explanation

REST = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
WEIGHED = [1, 2, 3]
"""Motors that hold more than friction at the start of the shipped motion."""
LOADS_KG = (0.0, 1.0, 3.0, 6.0)
SCALES = (0.5, 0.7, 1.3, 1.4, 2.0)
NOISE, TOOL_M = 0.01, 0.05
Array = NDArray[np.floating]


def held(arm: Arm, poses: Array, seed: int, load_kg: float) -> Array:
    """Torques of the motors that hold an arm, shape (P, n) [N m]; in a second pose of some."""
    file = arm.file
    if file.simulation is None:
        raise SystemExit("the shipped arm has a section `simulation`")
    truth = draw_truth(arm.robot, file.transmission, file.simulation, seed)
    model = with_parameters(arm.robot, truth.delta).model
    frame = model.frames[model.getFrameId(file.limits.tool_frame)]
    place = frame.placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, TOOL_M]))
    model.appendBodyToJoint(frame.parentJoint, pin.Inertia.FromSphere(load_kg + 1e-9, 0.03), place)
    data = model.createData()
    weight = [pin.computeGeneralizedGravity(model, data, q).copy() for q in poses]
    random = np.random.default_rng([seed, round(load_kg)])
    noise = NOISE * friction(arm) * random.standard_normal(poses.shape)
    torques = np.array(weight) @ arm.transmission.joint_from_motor + noise
    torques[1:, ~np.isin(np.arange(len(REST)), WEIGHED)] = np.nan
    return torques


def friction(arm: Arm) -> Array:
    """Coulomb friction to expect on the motors, shape (n,) [N m]."""
    return np.abs(arm.transmission.joint_from_motor).T @ expected_friction(arm.file)[1]


def explained(arm: Arm, poses: Array, torques: Array) -> Explanation:
    """What explains them."""
    tool = arm.file.limits.tool_frame
    return explanation(arm.robot, arm.transmission, tool, poses, torques, friction(arm))


def tables(arm: Arm, poses: Array, arms: int) -> None:
    """False alarms, and what is found of wrong scales."""
    print("| tool | false alarms | largest distance |\n| --- | --- | --- |")
    for load_kg in LOADS_KG:
        found = [explained(arm, poses, held(arm, poses, seed, load_kg)) for seed in range(arms)]
        alarms = sum(e.fault((e.scale, e.scale)) is not None for e in found)
        print(f"| {load_kg:g} kg | {alarms} of {arms} | {max(e.distance for e in found):.2f} |")
    print("\n| motor |" + "".join(f" x {scale:g} |" for scale in SCALES))
    print("| --- " * (1 + len(SCALES)) + "|")
    healthy = [held(arm, poses, seed, 0.0) for seed in range(arms)]
    for motor in range(1, 6):
        shares = []
        for scale in SCALES:
            factors = np.ones(len(REST))
            factors[motor] = 1.0 / scale
            found = [explained(arm, poses, factors * torques) for torques in healthy]
            named = [e.motor == motor and e.fault((e.scale, e.scale)) is not None for e in found]
            shares.append(f"{100 * np.mean(named):.0f} %")
        print(f"| {motor + 1} | {' | '.join(shares)} |")


def main() -> None:
    """In the resting pose, and in that and the first of the shipped motion."""
    arms = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    prepared = prepare("wam7.yaml")
    start = prepared.excitation.q[0]
    for poses in ([REST], [REST, start]):
        print(f"\n{len(poses)} poses:\n")
        tables(prepared.arm, np.array(poses), arms)


if __name__ == "__main__":
    main()
