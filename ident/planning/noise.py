"""What an answer leaves of the torque, written down before a motion: its predictions' noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import Windows
from ident.gap.regression.current_model import CurrentFit
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

BLOCK_S = 1.5
"""Residuals this far apart count as independent: longer than they correlate, as in `ident gap`."""

_ENOUGH = 8  # rows of a region that tell its noise


@dataclass(frozen=True)
class Noise:
    """Residuals by joint and noise region, as `ident gap` tells them apart.

    What dry friction does while a joint turns back is known far worse than what it does while the
    joint slides: rows of both that counted alike would hide any small effect.

    Attributes:
        sigma: rms of the windowed residual [N m], shape (n, regions); infinite for a held joint.
        slow: speed below which a joint counts as turning back [rad/s], shape (n,).
        cutoff_hz: of the windows.
        motors: motor angles from joint angles, shape (n, n), or None where unknown.
    """

    sigma: Array
    slow: Array
    cutoff_hz: float
    motors: Array | None

    def of_rows(self, speed: Array, windows: Windows) -> Array:
        """Of each window's mean [N m], shape (R, n), for velocities [rad/s] of shape (S, n)."""
        where = regions(speed, self.slow, self.motors, windows)
        return self.sigma[np.arange(self.sigma.shape[0]), where]

    def content(self) -> dict[str, Any]:
        """As `plan.json` keeps it; null for a held joint."""
        known = np.where(np.isfinite(self.sigma), self.sigma, np.nan)
        return {
            "sigma_nm": [[None if np.isnan(x) else float(x) for x in row] for row in known],
            "regions": [r.name.lower() for r in Region],
            "slow_rad_s": self.slow.tolist(),
            "cutoff_hz": self.cutoff_hz,
            "motor_from_joint": None if self.motors is None else self.motors.tolist(),
        }


def noise_of(current: CurrentFit, windows: Windows) -> Noise:
    """The noise of a fit; a region with hardly any rows gets that of the joint's worst one."""
    found, moving = current.fit, current.model.facts.moving
    seen = np.where(found.counts >= _ENOUGH, found.sigma, 0.0)
    sigma = np.where(found.counts >= _ENOUGH, found.sigma, seen.max(axis=1, keepdims=True))
    known = moving[:, None] & (sigma > 0.0)
    motors = current.model.facts.motor_from_joint
    sigma = np.where(known, sigma, np.inf)
    return Noise(sigma, current.model.slow, windows.cutoff_hz, motors)


def read_noise(content: dict[str, Any]) -> Noise:
    """The noise that a plan keeps.

    Raises:
        LookupError, TypeError, ValueError: the content is no noise.
    """
    sigma = [[np.inf if x is None else float(x) for x in row] for row in content["sigma_nm"]]
    motors = content["motor_from_joint"]
    slow = np.array(content["slow_rad_s"], dtype=float)
    known = None if motors is None else np.array(motors, dtype=float)
    return Noise(np.array(sigma), slow, float(content["cutoff_hz"]), known)


def rows_of_block(windows: Windows) -> int:
    """Rows of a block of time."""
    return round(BLOCK_S * windows.rate_hz / windows.hop)


def in_blocks(values: Array, windows: Windows) -> Array:
    """Sums over blocks that count as independent, shape (B, n), of rows of shape (R, n)."""
    size = rows_of_block(windows)
    whole = values[: len(values) // size * size]
    return whole.reshape(-1, size, values.shape[1]).sum(axis=1)


def stretches(data: Dataset) -> list[SmoothedSegment]:
    """The recording's unbroken stretches, smoothed.

    Raises:
        DataError: none is long enough.
    """
    found = [smoothed(s, data.rate_hz, 0) for s in data.segments]
    long = [s for s in found if s is not None]
    if not long:
        raise DataError(f"{data.name}: too short to say how well an answer predicted it.")
    return long
