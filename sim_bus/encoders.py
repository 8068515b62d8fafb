"""The motors' encoders."""

import numpy as np
from numpy.typing import NDArray

from sim_bus.plant import Plant

Array = NDArray[np.floating]


class Encoders:
    """Readings of all encoders at one instant, worked out when the first drive asks for its own.

    Args:
        plant: whose joints they see.
        counts_from_joint: counts per joint angle [1/rad], shape (n, n).
        zero_counts: readings at the arm's zero pose, shape (n,).
    """

    def __init__(self, plant: Plant, counts_from_joint: Array, zero_counts: Array) -> None:
        self._plant = plant
        self._counts_from_joint = counts_from_joint
        self._zero_counts = zero_counts
        self._time_ns = 0
        self._readings: list[tuple[int, int]] | None = None
        self._stuck: dict[int, tuple[int, int]] = {}

    def set_time(self, time_ns: int) -> None:
        """Which instant `read` is about; the physics has come up to it."""
        self._time_ns = time_ns
        self._readings = None

    def read(self, motor: int) -> tuple[int, int]:
        """Position [counts] and velocity [counts/s] of a motor, as 32-bit registers hold them."""
        if motor in self._stuck:
            return self._stuck[motor]
        if self._readings is None:
            seen = np.array([self._plant.seen_at(self._time_ns), self._plant.qd])
            numbers = seen @ self._counts_from_joint.T
            numbers[0] += self._zero_counts
            self._readings = list(zip(*_register(numbers), strict=True))
        return self._readings[motor]

    def jump(self, motor: int, counts: int) -> None:
        """Shift a motor's reading from now on."""
        self._zero_counts = self._zero_counts.copy()
        self._zero_counts[motor] += counts
        self._readings = None

    def stick(self, motor: int) -> None:
        """Keep a motor's present position, at rest."""
        self._stuck[motor] = (self.read(motor)[0], 0)

    def loosen(self, motor: int) -> None:
        """End what `stick` began."""
        self._stuck.pop(motor, None)


def _register(numbers: Array) -> list[list[int]]:
    """The numbers as 32-bit registers hold them, which overflow."""
    return np.rint(numbers).astype(np.int64).astype(np.int32).tolist()
