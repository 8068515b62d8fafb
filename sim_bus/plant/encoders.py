"""The motors' encoders."""

import numpy as np

from sim_bus.plant.plant import Plant
from wamctl.arm.arrays import Array


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
        self._positions: list[int] | None = None
        self._speeds: list[int] | None = None
        self._stuck: dict[int, int] = {}

    def set_time(self, time_ns: int) -> None:
        """Which instant the readings are about; the physics has come up to it."""
        self._time_ns = time_ns
        self._positions = self._speeds = None

    def position(self, motor: int) -> int:
        """Position of a motor [counts], as a 32-bit register holds it."""
        if motor in self._stuck:
            return self._stuck[motor]
        if self._positions is None:
            seen = self._plant.seen_at(self._time_ns)
            self._positions = _register(self._counts_from_joint @ seen + self._zero_counts)
        return self._positions[motor]

    def speed(self, motor: int) -> int:
        """Velocity of a motor [counts/s], as a 32-bit register holds it."""
        if motor in self._stuck:
            return 0
        if self._speeds is None:
            self._speeds = _register(self._counts_from_joint @ self._plant.qd)
        return self._speeds[motor]

    def jump(self, motor: int, counts: int) -> None:
        """Shift a motor's reading from now on."""
        self._zero_counts = self._zero_counts.copy()
        self._zero_counts[motor] += counts
        self._positions = None

    def freeze(self, motor: int) -> None:
        """Keep a motor's present position, at rest."""
        self._stuck[motor] = self.position(motor)

    def unfreeze(self, motor: int) -> None:
        """End what `freeze` began."""
        self._stuck.pop(motor, None)


def _register(numbers: Array) -> list[int]:
    """The numbers as 32-bit registers hold them, which overflow."""
    return np.rint(numbers).astype(np.int64).astype(np.int32).tolist()
