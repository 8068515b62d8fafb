"""Effects as `model.yaml` holds them: every number by its name."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from ident.effects.candidate import Candidate, fields_of
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]


def effects_entries(
    accepted: Sequence[Candidate], values: Sequence[Array]
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
            "settings": _written(h.parameters),
            "rows": [j + 1 for j in h.rows],
        }
        for h, theta in zip(accepted, values, strict=True)
    )


def _written(parameters: Any) -> dict[str, Any]:
    """The fields of an effect's parameters that it uses, as YAML holds them."""
    used = {name: value for name, value in fields_of(parameters).items() if value is not None}
    return {name: _listed(value) for name, value in used.items()}


def _listed(value: Any) -> Any:
    return [_listed(x) for x in value] if isinstance(value, tuple) else value


def effect_of(entry: dict[str, Any]) -> tuple[Candidate, Array]:
    """An effect of a `model.yaml`, and its coefficients, shape (k,).

    Raises:
        DataError: an effect that the catalogue does not know, or that is not complete.
    """
    effects = catalogue()
    name = entry.get("name")
    if name not in effects:
        known = ", ".join(effects)
        raise DataError(f"The model holds an effect {name!r}; this program knows {known}.")
    try:
        joints, rows = ([int(j) - 1 for j in entry[key]] for key in ("joints", "rows"))
        parameters = _read(effects[name], entry["settings"])
        candidate = effects[name].at(joints, parameters, entry["variant"], rows)
        return candidate, _values(candidate, entry["parameters"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"The model's effect {name} is not complete ({error!r}).") from error


def _read(effect: Effect, settings: dict[str, Any]) -> Any:
    """An effect's parameters, from their names and values.

    Raises:
        DataError: one that is missing or unknown, or of the wrong kind.
    """
    try:
        return TypeAdapter(effect.Parameters).validate_python(dict(settings))
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(map(str, e['loc'])) or 'settings'}: {e['msg']}" for e in error.errors()
        )
        raise DataError(
            f"The settings of the model's effect {effect.id} cannot be used ({faults}); make the"
            " model again with ident gap."
        ) from error


def _values(candidate: Candidate, parameters: dict[str, Any]) -> Array:
    """The coefficients in the order of the columns, shape (k,).

    Raises:
        DataError: other names than the effect's.
    """
    names = [c.name for c in candidate.coefficients]
    if set(names) != set(parameters):
        raise DataError(
            f"The model's effect {candidate.effect} has the parameters {', '.join(parameters)};"
            f" they must be {', '.join(names)}."
        )
    return np.array([float(parameters[name]) for name in names])
