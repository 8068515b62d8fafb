"""A motion tried out on the arm as it is known so far: the standard errors of its recording.

What a recording's noise is made of, where a joint turns back or nearly stops, only the closed loop
shows; `noise.py` is the formula for it that a descent can follow.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.regression_data import reduce_recordings
from ident.excitation.problem.trajectory_grid import series_of
from ident.identification.standard_errors import standard_errors
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset, dataset
from ident.recordings.steady_state import only_steady_state
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm
from ident.simulation.loop import Controller, Wire, recorded, run
from wamctl.arm.errors import DataError
from wamctl.arm.trajectory import Trajectory, reference, trajectory_yaml

_ARMS = 3
"""Of one arm alone, a search finds motions that are good there by luck."""

_FRICTION, _LINKS = 0.15, 0.05
"""Standard deviations of the arms' differences, in the logarithm."""


@dataclass(frozen=True)
class ClosedLoopTrial:
    """The arm to try a motion on.

    Attributes:
        arm: how recordings are processed.
        controller, wire: what moves the arm.
        plants: the arm as a model has it, and some that are nearly like it.
        weights: of parameters or kinds of parameters; 1 for those that are not named.
        fundamental_rad_s: of the motion.
        ramp_s: before and after it.
    """

    arm: Arm
    controller: Controller
    wire: Wire
    plants: tuple[SimulatedArm, ...]
    weights: dict[str, float]
    fundamental_rad_s: float
    ramp_s: float

    def prepare(self) -> None:
        """Compile what the first motion would otherwise wait for."""
        still = np.zeros((2, self.arm.robot.dof))
        run(self.plants[0], self.controller, self.wire, (still, still, still))

    def errors(self, coefficients: Array) -> Iterator[float]:
        """Mean logarithm of the standard errors after one period, as `ident run` finds them.

        Args:
            coefficients: of the series, shape (2 L + 1, n).

        Yields:
            The mean over the parameters, for one arm after the other.

        Raises:
            DataError: the motion is too small to tell.
        """
        for plant in self.plants:
            yield self._errors(self._recorded(coefficients, plant))

    def _errors(self, data: Dataset) -> float:
        if not data.moving.all():
            raise DataError(f"{data.name}: not every joint moves.")
        evidence = reduce_recordings(
            [data], self.arm.with_settings(reversals="culled")
        )  # in half the time
        named = evidence.base.kept_parameters
        own = [self.weights.get(p.name, self.weights.get(str(p.kind), 1.0)) for p in named]
        return float(np.average(np.log(standard_errors(evidence)), weights=own))

    def _recorded(self, coefficients: Array, plant: SimulatedArm) -> Dataset:
        names = self.arm.robot.joint_names
        series = series_of(coefficients, names, self.fundamental_rad_s)
        motion = reference(series, 1, self.ramp_s, self.wire.period_s)
        made = run(plant, self.controller, self.wire, (motion.q, motion.qd, motion.qdd))
        trajectory = trajectory_yaml(Trajectory(series, 1, {}, {})).encode()
        recording = recorded(names, motion, made, {"trajectory.yaml": trajectory}, {})
        data = dataset(recording, names, "trial")
        return only_steady_state(data, recording, data.name)


def nearly(known: SimulatedArm) -> tuple[SimulatedArm, ...]:
    """The arm, and others whose links and friction differ a little."""
    rng, joints = np.random.default_rng(0), len(known.viscous)

    def drawn() -> SimulatedArm:
        links = np.repeat(np.exp(_LINKS * rng.normal(size=joints)), len(known.delta) // joints)
        friction = np.exp(_FRICTION * rng.normal(size=len(known.coulomb)))
        return replace(known, delta=links * known.delta, coulomb=friction * known.coulomb)

    return (known, *[drawn() for _ in range(_ARMS - 1)])
