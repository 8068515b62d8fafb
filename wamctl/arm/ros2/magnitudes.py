"""What joints and their torques cannot exceed: a larger number is no measurement."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wamctl.arm.arrays import Array


@dataclass(frozen=True)
class Magnitude:
    """A kind of number, and what it stays below.

    Attributes:
        most: the largest absolute value.
        unit: of it.
        reason: why nothing larger is measured.
    """

    most: float
    unit: str
    reason: str


POSITION = Magnitude(1e5, "rad or m", "16,000 turns, or 100 km, which no joint of an arm reaches")
"""A joint that turns on at 20 rad/s gets there in 80 minutes; angles in degrees lie below, too."""

TORQUE = Magnitude(1e9, "N m or N", "ten times what the heaviest robots exert, in N mm")
"""The main joints of the heaviest robots bear 1e5 N m; whatever the unit, it is judged later on."""


def excess(
    values: Array, magnitude: Magnitude, joints: Sequence[str], when: Callable[[int], str]
) -> str:
    """What is wrong with the first value that is too large, without its subject; empty: none is.

    Args:
        values: shape (S, n).
        magnitude: what they stay below.
        joints: names of the columns.
        when: what to call a sample.
    """
    large = np.abs(values) > magnitude.most
    if not large.any():
        return ""
    sample, joint = (int(k) for k in np.argwhere(large)[0])
    return (
        f"of {joints[joint]} is {values[sample, joint]:.3g} {when(sample)}, beyond"
        f" {magnitude.most:g} {magnitude.unit} ({magnitude.reason}): counts of an encoder, or a"
        " damaged recording; convert it, or leave out what is damaged."
    )
