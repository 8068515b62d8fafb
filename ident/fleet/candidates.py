"""What may change in an arm, by name: directions in the space of its parameters."""

from dataclasses import dataclass, replace

import numpy as np

from ident.fleet.arm_type import TOOL, ArmType
from ident.fleet.settings import FleetSettings
from ident.signals.arrays import Array

_ANGLE_LEFT_OUT = 0.5
"""Of a turned zero [1/rad]: weight is a sum of a sine and a cosine, whose next term is that."""


@dataclass(frozen=True)
class Candidate:
    """One possible change.

    Attributes:
        name: effect of the catalogue, or `parameter`.
        joints: from 1.
        parameters: names of its k numbers.
        units: theirs.
        V: change of the p parameters per unit of each, shape (p, k).
        usual: usual size of each, shape (k,).
        reported: weights by which the k numbers make up the one that is reported, shape (k,);
            zeros: the one that is surest.
        reported_name: of that one.
        left_out: error of the size that the torque's linear term leaves, over its square [1/unit].
    """

    name: str
    joints: tuple[int, ...]
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    V: Array
    usual: Array
    reported: Array
    reported_name: str = ""
    left_out: float = 0.0

    @property
    def direction(self) -> Array:
        """A change of usual size in what is reported, shape (k,)."""
        return self.usual * (self.reported if self.reported.any() else 1.0)

    @property
    def reported_usual(self) -> float:
        """Usual size of what is reported; of the first number, where it is the surest one."""
        return float(self.reported @ self.usual if self.reported.any() else self.usual[0])


def candidates(
    kind: ArmType, mean: Array, spread: Array, settings: FleetSettings
) -> tuple[Candidate, ...]:
    """All that is looked for in arms of a type.

    Args:
        kind: the type.
        mean: of its parameters, shape (p,).
        spread: their standard deviation between arms, shape (p,).
        settings: of the fleet.
    """
    found = []
    for joint in range(1, len(kind.joints) + 1):
        for coulomb, viscous in (("fc", "fv"), ("fcm", "fvm")):
            level = kind.places.get((coulomb, joint), [])
            drag = kind.places.get((viscous, joint), [])
            if level or drag:
                found.append(_friction(kind, mean, (*level, *drag), joint, settings))
        dry = kind.places.get(("fc", joint), [])
        size = settings.torque_share * abs(mean[dry[0]]) if dry else 0.0
        for place in kind.places.get(("fo", joint), []):
            usual = max(size, 3.0 * spread[place])
            found.append(_single(kind, place, "torque_offset", joint, usual))
        fading = kind.places.get(("stribeck", joint), [])
        if fading and size > 0.0:
            found.append(_stribeck(kind, fading, joint, size))
        for place in kind.places.get(("zero", joint), []):
            if kind.cad.any():
                zero = _single(kind, place, "encoder_offset", joint, settings.zero_rad)
                found.append(replace(zero, left_out=_ANGLE_LEFT_OUT))
        for place in kind.places.get(("ia", joint), []):
            usual = settings.friction_share * abs(mean[place])
            found.append(_single(kind, place, "parameter", joint, usual))
    if kind.payload.any():
        found.append(_payload(kind, settings))
    return tuple(found)


def _units(kind: ArmType, places: tuple[int, ...] | list[int]) -> Array:
    V = np.zeros((len(kind.names), len(places)))
    V[list(places), range(len(places))] = 1.0
    return V


def _friction(
    kind: ArmType, mean: Array, places: tuple[int, ...], joint: int, settings: FleetSettings
) -> Candidate:
    names = tuple(kind.names[k].text for k in places)
    units = tuple(kind.names[k].unit for k in places)
    usual = settings.friction_share * np.abs(mean[list(places)])
    V = _units(kind, places)
    return Candidate("parameter", (joint,), names, units, V, usual, np.zeros(len(places)))


def _single(kind: ArmType, place: int, name: str, joint: int, usual: float) -> Candidate:
    text, unit = kind.names[place].text, kind.names[place].unit
    V, one = _units(kind, [place]), np.ones(1)
    return Candidate(name, (joint,), (text,), (unit,), V, usual * one, one, text)


def _stribeck(kind: ArmType, places: list[int], joint: int, usual: float) -> Candidate:
    names = tuple(kind.names[k].text for k in places)
    ones = np.ones(len(places))
    V = _units(kind, places)
    units = ("N m",) * len(places)
    return Candidate(
        "stribeck", (joint,), names, units, V, usual * ones, ones, f"extra_friction{joint}"
    )


def _payload(kind: ArmType, settings: FleetSettings) -> Candidate:
    """A rigid load at the tool: linear in its ten parameters."""
    first = settings.payload_kg * settings.payload_m
    second = first * settings.payload_m
    return Candidate(
        "payload",
        (len(kind.joints),),
        TOOL,
        ("kg", *("kg m",) * 3, *("kg m^2",) * 6),
        kind.payload,
        np.array([settings.payload_kg, *[first] * 3, *[second] * 6]),
        np.eye(len(TOOL))[0],
        TOOL[0],
    )
