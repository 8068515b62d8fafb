"""Bounds on mass and centre of mass, beyond what any arm must keep: the settings' options."""

from collections.abc import Sequence

import numpy as np

from ident.dynamics.parameters import Parameter
from ident.estimation.feasible_set import Constraint, link_places, links_of
from ident.signals.arrays import Array
from wamctl.arm.config import IdentificationSection
from wamctl.arm.errors import ConfigurationError


def bounds(
    settings: IdentificationSection, parameters: Sequence[Parameter], prior: Array
) -> list[Constraint]:
    """Linear constraints on delta.

    Args:
        settings: total mass, boxes of the centres of mass, spread around CAD; unset ones bind
            nothing.
        parameters: the p entries of delta.
        prior: delta of the CAD model, shape (p,).

    Raises:
        ConfigurationError: boxes that do not fit the links.
    """
    links = {k: link_places(parameters, k) for k in links_of(parameters)}
    unit = np.eye(len(parameters))
    constraints = []
    if settings.total_mass_kg is not None:
        total = -unit[[places[9] for places in links.values()]].sum(axis=0, keepdims=True)
        text = f"total mass <= {settings.total_mass_kg:g} kg"
        constraints.append(Constraint(0, text, 0, total, np.array([-settings.total_mass_kg])))
    if settings.center_of_mass_box_m is not None:
        constraints += _boxes(settings.center_of_mass_box_m, links, unit)
    if settings.cad_spread is not None:
        for k, places in links.items():
            mass, s = prior[places[9]], settings.cad_spread
            A = np.stack([unit[places[9]], -unit[places[9]]])
            b = np.array([(1 - s) * mass, -(1 + s) * mass])
            constraints.append(Constraint(k, f"mass within {s:.0%} of CAD", 0, A, b))
    return constraints


def _boxes(
    boxes: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...],
    links: dict[int, list[int]],
    unit: Array,
) -> list[Constraint]:
    """First moments inside the boxes: l - m lower >= 0 and m upper - l >= 0, axis by axis."""
    shapes = {len(corner) for box in boxes for corner in box}
    if len(boxes) != len(links) or shapes != {3}:
        raise ConfigurationError(
            "identification.center_of_mass_box_m",
            [f"{len(boxes)} boxes for {len(links)} links; give two corners of three numbers each"],
        )
    constraints = []
    for (k, places), (lower, upper) in zip(links.items(), boxes, strict=True):
        first, mass = unit[places[6:9]], unit[places[9]]
        A = np.concatenate([first - np.outer(lower, mass), np.outer(upper, mass) - first])
        constraints.append(Constraint(k, "centre of mass in its box", 0, A, np.zeros(6)))
    return constraints
