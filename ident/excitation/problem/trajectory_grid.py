"""Fourier series (46) on an even grid over one period, as linear maps of the coefficients."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.regressor import Motion
from ident.signals.arrays import Array
from wamctl.arm.trajectory import FourierSeries


@dataclass(frozen=True)
class Grid:
    """Maps from coefficients, shape (2 L + 1, n), to S samples, each of shape (S, 2 L + 1).

    Attributes:
        position, velocity, acceleration, jerk: one matrix for each derivative.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    @property
    def samples(self) -> int:
        """Number of samples S."""
        return len(self.position)

    def motion(self, coefficients: Array) -> Motion:
        """Position [rad], velocity [rad/s] and acceleration [rad/s^2]."""
        return Motion(
            self.position @ coefficients,
            self.velocity @ coefficients,
            self.acceleration @ coefficients,
        )


def grid(fundamental_rad_s: float, harmonics: int, samples: int) -> Grid:
    """The grid of one period.

    Args:
        fundamental_rad_s: omega_f of (46) [rad/s].
        harmonics: L of (46).
        samples: number of samples S; the period's end is not repeated.
    """
    omega = fundamental_rad_s * np.arange(1, harmonics + 1)
    phase = np.outer(np.arange(samples) * (2 * np.pi / samples), np.arange(1, harmonics + 1))
    sin, cos = np.sin(phase), np.cos(phase)
    one, zero = np.ones((samples, 1)), np.zeros((samples, 1))
    return Grid(
        np.hstack([sin / omega, -cos / omega, one]),
        np.hstack([cos, sin, zero]),
        np.hstack([-sin * omega, cos * omega, zero]),
        np.hstack([-cos * omega**2, -sin * omega**2, zero]),
    )


def coefficients_of(series: FourierSeries) -> Array:
    """All free variables of a series, shape (2 L + 1, n): L rows a, L rows b, one row q0."""
    return np.vstack([series.a.T, series.b.T, series.q0])


def series_of(
    coefficients: Array, joint_names: tuple[str, ...], fundamental_rad_s: float
) -> FourierSeries:
    """The series of coefficients, shape (2 L + 1, n)."""
    harmonics = len(coefficients) // 2
    return FourierSeries(
        joint_names,
        fundamental_rad_s,
        coefficients[:harmonics].T.copy(),
        coefficients[harmonics:-1].T.copy(),
        coefficients[-1].copy(),
    )
