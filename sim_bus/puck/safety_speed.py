"""The speed that a classic WAM's safety module watches: of the elbow, and of a point beyond it."""

from collections import deque
from math import cos, dist, sin

from wamctl.arm.arrays import Array

Point = tuple[float, float, float]

HISTORY = 5
"""Position samples between whose first and last the speed is measured."""
ELBOW_M, BEYOND_ELBOW_M = 0.55, 0.35


class SafetySpeed:
    """Speed over the last few position samples.

    Attributes:
        m_s: the faster point's speed [m/s]; 0 until there are enough samples.
    """

    def __init__(self) -> None:
        self.m_s = 0.0
        self._samples: deque[tuple[int, tuple[Point, Point]]] = deque(maxlen=HISTORY)

    def forget(self) -> None:
        """Start anew, as when positions are no longer known."""
        self.m_s = 0.0
        self._samples.clear()

    def add(self, time_ns: int, q: Array) -> None:
        """One more sample of the joint angles [rad], shape (n,)."""
        self._samples.append((time_ns, watched_points(q)))
        (first_ns, first), (last_ns, last) = self._samples[0], self._samples[-1]
        if len(self._samples) == HISTORY and last_ns > first_ns:
            longest = max(dist(a, b) for a, b in zip(first, last, strict=True))
            self.m_s = longest / (last_ns - first_ns) * 1e9


def watched_points(q: Array) -> tuple[Point, Point]:
    """Elbow, and the point 0.35 m beyond it, seen from the shoulder [m].

    The 45 mm offsets of the links to both sides of the elbow are left out: the sources give the
    distances 550 mm and 350 mm only.

    Args:
        q: joint angles [rad]; those of the wrist do not matter.
    """
    yaw, pitch, twist, bend = (float(angle) for angle in q[:4])
    upper = _turned((sin(pitch), 0.0, cos(pitch)), yaw)
    forearm = (sin(bend) * cos(twist), sin(bend) * sin(twist), cos(bend))
    pitched = (
        cos(pitch) * forearm[0] + sin(pitch) * forearm[2],
        forearm[1],
        cos(pitch) * forearm[2] - sin(pitch) * forearm[0],
    )
    x, y, z = _turned(pitched, yaw)
    elbow = (ELBOW_M * upper[0], ELBOW_M * upper[1], ELBOW_M * upper[2])
    beyond = (
        elbow[0] + BEYOND_ELBOW_M * x,
        elbow[1] + BEYOND_ELBOW_M * y,
        elbow[2] + BEYOND_ELBOW_M * z,
    )
    return elbow, beyond


def _turned(point: Point, yaw: float) -> Point:
    x, y, z = point
    return cos(yaw) * x - sin(yaw) * y, sin(yaw) * x + cos(yaw) * y, z
