"""Masses of a URDF that a recording contradicts, and what it says instead.

A recording tells base parameters, not masses. So it is asked which links' masses would have to be
others, with centres of mass and tensors about them as the URDF has them: generalised least squares
of the difference between identified and CAD base parameters on the masses, one link after the
other, as long as one more is significant. One that stood in for others that came after it is left
out again where it is not significant beside them. What masses cannot explain (tensors that are
wrong too) counts as scatter, so that it lowers the significance of all of them (Birge 1932).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.identification.identify import Identification
from ident.signals.arrays import Array
from wamctl.arm.inertial import PINOCCHIO_INDEX, change_of_frame
from wamctl.arm.robot import Robot

SIGNIFICANT = 4.0
"""Standard errors: with as many links as an arm has, chance reaches it once in 1,000 recordings."""

_LEAST_SHARE = 0.05
"""Of a mass: smaller differences are nobody's mistake."""


@dataclass(frozen=True)
class Contradiction:
    """A mass that a recording contradicts.

    Attributes:
        joint: that carries it, from 1.
        name: of the joint.
        urdf_kg: mass of all links that move with it, up to the next joint [kg].
        found_kg: what the recording says, if nothing else of these links is wrong [kg].
        sd_kg: its standard error [kg].
    """

    joint: int
    name: str
    urdf_kg: float
    found_kg: float
    sd_kg: float

    @property
    def sentence(self) -> str:
        """In words."""
        impossible = (
            "; since no mass is negative, something else than this mass is wrong"
            if self.found_kg < -2 * self.sd_kg
            else ""
        )
        return (
            f"joint {self.joint} ({self.name}) carries {self.urdf_kg:.3g} kg in the URDF, and"
            f" {self.found_kg:.3g} kg by the recording (standard error {self.sd_kg:.2g} kg,"
            f" {100 * (self.found_kg / self.urdf_kg - 1):+.0f} %){impossible}"
        )

    def content(self) -> dict[str, Any]:
        """As it stands in JSON."""
        return asdict(self) | {"sentence": self.sentence}


@dataclass(frozen=True)
class Weighed:
    """What a recording says of the masses.

    Attributes:
        contradictions: the fewest masses that must be others.
        unseen: joints, from 1, whose mass could be twice as large without being seen.
    """

    contradictions: tuple[Contradiction, ...]
    unseen: tuple[int, ...]


def weighed(found: Identification) -> Weighed:
    """Compare the masses of the arm's URDF with what was identified."""
    robot = found.evidence.arm.robot
    masses = np.array([inertia.mass for inertia in list(robot.model.inertias)[1:]])
    A, y = _whitened(found)
    seen = np.linalg.norm(A, axis=0) * masses.sum() > SIGNIFICANT  # were it as heavy as the arm
    chosen = selected(A, y, masses, seen)
    unseen = [
        k
        for k in range(robot.dof)
        if k not in chosen
        and (not seen[k] or SIGNIFICANT * _fit(A, y, [*chosen, k])[-1][1] > masses[k])
    ]
    fits = zip(chosen, _fit(A, y, chosen), strict=True)
    return Weighed(
        tuple(
            Contradiction(k + 1, robot.joint_names[k], masses[k], masses[k] + change, sd)
            for k, (change, sd) in fits
        ),
        tuple(k + 1 for k in unseen),
    )


def selected(A: Array, y: Array, masses: Array, seen: NDArray[np.bool_]) -> list[int]:
    """Links, from 0, whose masses must be others: the fewest that explain the difference.

    Args:
        A: change of the base parameters by each mass, in standard errors, shape (b, n).
        y: their difference from the URDF's, in standard errors, shape (b,).
        masses: of the URDF [kg], shape (n,).
        seen: which masses the motion shows, shape (n,).
    """
    chosen: list[int] = []
    while len(chosen) < min(seen.sum(), len(y) - 2):
        others = [int(k) for k in np.flatnonzero(seen) if k not in chosen]
        nearest = min(others, key=lambda k: _left(A[:, [*chosen, k]], y))
        if _sizes(A, y, masses, [*chosen, nearest])[-1] < 1.0:
            break
        chosen.append(nearest)
    while chosen and (sizes := _sizes(A, y, masses, chosen)).min() < 1.0:
        chosen.pop(int(np.argmin(sizes)))
    return chosen


def _sizes(A: Array, y: Array, masses: Array, chosen: list[int]) -> Array:
    """Change of each chosen mass beside the least that counts, shape (k,)."""
    change, sd = np.transpose(_fit(A, y, chosen))
    return np.abs(change) / np.maximum(SIGNIFICANT * sd, _LEAST_SHARE * masses[chosen])


def _fit(A: Array, y: Array, chosen: list[int]) -> list[tuple[float, float]]:
    """Change and standard error of each chosen mass [kg]."""
    columns = A[:, chosen]
    solution = np.linalg.lstsq(columns, y, rcond=None)[0]
    scatter = _left(columns, y) / (len(y) - len(chosen))
    variance = max(scatter, 1.0) * np.diag(np.linalg.pinv(columns.T @ columns))
    return list(zip(solution.tolist(), np.sqrt(variance).tolist(), strict=True))


def _left(columns: Array, y: Array) -> float:
    """Sum of squares that the columns leave."""
    return float(np.sum((y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]) ** 2))


def _whitened(found: Identification) -> tuple[Array, Array]:
    """Change of the base parameters by each link's mass, and their difference from CAD.

    Both are divided by the square root of the covariance, so that their errors are independent and
    of size 1. Friction and the other parameters that CAD does not know are free.
    """
    evidence = found.evidence
    base, R = evidence.base, evidence.problem().R[:-1, :-1]
    inverse = np.linalg.inv(R.T @ R)
    inflation = found.sd / np.sqrt(np.diag(inverse))
    covariance = inverse * np.outer(inflation, inflation)
    known = [i for i, p in enumerate(base.kept_parameters) if p.kind == "inertial"]
    root = np.linalg.cholesky(covariance[np.ix_(known, known)])
    difference = (found.estimates["ols"].beta - base.K @ evidence.prior)[known]
    by_mass = (base.K @ _derivatives(evidence.arm.robot, [p.name for p in base.parameters]))[known]
    return np.linalg.solve(root, by_mass), np.linalg.solve(root, difference)


def _derivatives(robot: Robot, names: Sequence[str]) -> Array:
    """Change of delta by each link's mass, its shape being as it is, shape (p, n)."""
    places = {name: i for i, name in enumerate(names)}
    result = np.zeros((len(names), robot.dof))
    for k, placement in enumerate(robot.parameter_placements):
        inertia = robot.model.inertias[k + 1].copy()
        inertia.inertia = np.zeros((3, 3))
        if inertia.mass > 0:
            inertia.mass = 1.0
            point = inertia.toDynamicParameters()[list(PINOCCHIO_INDEX)]
            link = change_of_frame(np.linalg.inv(placement)) @ point
            for name, value in zip(robot.inertial_names[10 * k :][:10], link, strict=True):
                result[places[name], k] = value
    return result
