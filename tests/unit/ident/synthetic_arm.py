"""Arms and recordings with a known truth, for the tests of this folder."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.model.arm import Arm
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters, inverse_dynamics
from wamctl.arm.trajectory import read_trajectory, sample

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """An arm that obeys the model: links as CAD has them, friction (3)."""

    arm: Arm
    fv: Array
    fc: Array

    @property
    def delta(self) -> Array:
        """Standard parameters with viscous and Coulomb friction, in the order of (8)."""
        links = cad_parameters(self.arm.robot).reshape(-1, 10)
        return np.column_stack([links, self.fv, self.fc]).ravel()

    def torque(self, q: Array, qd: Array, qdd: Array) -> Array:
        rigid = inverse_dynamics(self.arm.robot, q, qd, qdd)
        return rigid + self.fv * qd + self.fc * np.sign(qd)


def motion(seconds: float, rate: float) -> tuple[Array, Array, Array, Array]:
    """Stamps, position, velocity, and acceleration of the shipped excitation."""
    series = read_trajectory("wam7-excitation.yaml").series
    t = np.arange(round(seconds * rate)) / rate
    return t, *sample(series, t)


def recording(names, t: Array, q: Array, effort: Array, **more) -> Recording:
    stamps = np.round(t * 1e9).astype(np.int64)
    content = {"qd": None, "command": None, "reference": None, "metadata": {}, "attachments": {}}
    return Recording(tuple(names), stamps, q, effort=effort, **(content | more))
