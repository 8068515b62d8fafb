"""Effects as `model.yaml` holds them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.effects.catalogue import catalogue
from ident.effects.effect import Coefficient, Hypothesis
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]


def effects_entries(
    accepted: Sequence[Hypothesis], values: Sequence[Array]
) -> tuple[dict[str, Any], ...]:
    """Effects as `model.yaml` holds them."""
    return tuple(
        {
            "name": h.effect,
            "joints": [j + 1 for j in h.joints],
            "equation": catalogue()[h.effect].equation,
            "variant": h.variant,
            "parameters": {c.name: float(v) for c, v in zip(h.coefficients, theta, strict=True)},
            "units": {c.name: c.unit for c in h.coefficients},
            "settings": {k: float(v) for k, v in h.settings.items()},
            "rows": [j + 1 for j in h.rows],
        }
        for h, theta in zip(accepted, values, strict=True)
    )


def effect_of(entry: dict[str, Any]) -> tuple[Hypothesis, Array]:
    """An effect of a `model.yaml`, and its coefficients, shape (k,).

    Raises:
        DataError: an effect that the catalogue does not know, or that is not complete; a setting
            that is missing is noticed when it is used.
    """
    effects = catalogue()
    name = entry.get("name")
    if name not in effects:
        known = ", ".join(effects)
        raise DataError(f"The model holds an effect {name!r}; this program knows {known}.")
    try:
        hypothesis = Hypothesis(
            name,
            tuple(int(j) - 1 for j in entry["joints"]),
            tuple(int(j) - 1 for j in entry["rows"]),
            tuple(Coefficient(c, entry["units"][c]) for c in entry["parameters"]),
            _Settings(name, {k: float(v) for k, v in entry["settings"].items()}),
            entry["variant"],
        )
        values = np.array([float(v) for v in entry["parameters"].values()])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"The model's effect {name} is not complete ({error!r}).") from error
    return hypothesis, values


class _Settings(dict[str, float]):
    """Settings of an effect from a file, which an older program may have written."""

    def __init__(self, effect: str, values: dict[str, float]) -> None:
        super().__init__(values)
        self._effect = effect

    def __missing__(self, key: str) -> float:
        raise DataError(f"The model's effect {self._effect} has no setting {key!r}.")
