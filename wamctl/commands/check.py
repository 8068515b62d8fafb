"""All that can be said of an experiment without motion (`wamctl check`)."""

from dataclasses import dataclass

import numpy as np

from wamctl.arm.collision import collision_shapes
from wamctl.arm.trajectory import reference
from wamctl.arm.trajectory_check import Quantity, quantities
from wamctl.drives.bus_load import Load
from wamctl.experiment.preflight import Prepared
from wamctl.experiment.session import Setup, connected

_GRID_S = 0.005


@dataclass(frozen=True)
class Use:
    """How near a motion comes to a limit.

    Attributes:
        quantity: what is limited.
        subject: what comes nearest to its limit.
        value: its extreme value.
        limit: its limit.
        unit: of both.
        share: value over limit; for distances and positions, the share of what is allowed.
    """

    quantity: str
    subject: str
    value: float
    limit: float
    unit: str
    share: float


@dataclass(frozen=True)
class Check:
    """What was found.

    Attributes:
        arm: its name.
        seconds: length of the excitation, ramps included [s].
        uses: the nearest approach to each kind of limit.
        load: share of the bus.
        drives: names of the drives that answered as configured; empty where none were asked.
        notes: what the operator should know.
    """

    arm: str
    seconds: float
    uses: tuple[Use, ...]
    load: Load
    drives: tuple[str, ...]
    notes: tuple[str, ...]


def check(prepared: Prepared, setup: Setup | None) -> Check:
    """Examine a configuration that passed preflight, and the drives of a setup if there is one.

    Raises:
        UserError: the drives do not answer, or are others.
    """
    drives, notes = (), ()
    if setup is not None:
        with connected(setup) as connection:
            drives, notes = connection.drives.names, connection.notes
    file = prepared.arm.file
    seconds = float(prepared.excitation.t[-1])
    return Check(file.arm, seconds, uses(prepared), prepared.load, drives, notes)


def uses(prepared: Prepared) -> tuple[Use, ...]:
    """How near one period of the excitation, with its ramps, comes to each kind of limit."""
    arm, file = prepared.arm, prepared.arm.file
    motion = reference(prepared.trajectory.series, 1, file.excitation.ramp_s, _GRID_S)
    shapes = collision_shapes(arm.robot)
    limited = quantities(file, file.limits, arm.robot, shapes, motion)
    return tuple(_nearest(quantity) for quantity in limited if quantity.values.size)


def _nearest(quantity: Quantity) -> Use:
    """The subject that uses most of what its bounds leave it."""
    if np.isinf(quantity.upper).any():
        share = quantity.lower / quantity.values.min(axis=0)
        k = int(np.argmax(share))
        value, limit = quantity.values[:, k].min(), quantity.lower[k]
    elif np.isinf(quantity.lower).any():
        share = quantity.values.max(axis=0) / quantity.upper
        k = int(np.argmax(share))
        value, limit = quantity.values[:, k].max(), quantity.upper[k]
    else:
        middle, half = (quantity.upper + quantity.lower) / 2, (quantity.upper - quantity.lower) / 2
        way = np.abs(quantity.values - middle) / half
        i, k = np.unravel_index(int(np.argmax(way)), way.shape)
        value = quantity.values[i, k]
        limit = quantity.upper[k] if value > middle[k] else quantity.lower[k]
        share = way.max(axis=0)
    return Use(
        quantity.name,
        quantity.subjects[k],
        float(value),
        float(limit),
        quantity.unit,
        float(share[k]),
    )
