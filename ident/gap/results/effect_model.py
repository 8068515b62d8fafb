"""The identified arm with its effects: to `model.yaml`, and back into a simulation."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of
from ident.effects.catalogue import catalogue
from ident.effects.effect import Coefficient, Hypothesis
from ident.gap.data.experiment import Experiment
from ident.gap.data.segments import DIRECTION_HZ, MOTION_HZ
from ident.gap.data.windows import Windows
from ident.gap.regression.weighted_fit import Fit
from ident.gap.results.feasible_model import Possible
from ident.model.identified_model import BaseParameter, Filter, Model
from ident.simulation.arm import SETTINGS, SimulatedArm, Term, simulated_arm, term
from wamctl.arm.errors import DataError

Array = NDArray[np.floating]

_ORDER = 3


@term
def _offset(t, q, qd, load, joint, settings, resistance, level):
    resistance[joint] += settings[0]


@term
def _motor_drag(t, q, qd, load, joint, settings, resistance, level):
    speed = 0.0
    for k in range(qd.size):
        speed += settings[1 + k] * qd[k]
    resistance[joint] += settings[0] * speed


def model_with(
    source: Experiment,
    windows: Windows,
    fitted: Possible,
    fit: Fit,
    accepted: Sequence[Hypothesis],
    slow: Array,
) -> Model:
    """The possible arm with its effects, as `model.yaml` keeps it.

    Args:
        source: arm and recordings.
        windows: of the fit's rows.
        fitted: the possible parameters.
        fit: the free solution behind them.
        accepted: effects.
        slow: speed below which each joint counts as turning [rad/s], shape (n,).
    """
    effects = effects_entries(accepted, fitted.effects)
    if source.trusted is not None:
        return replace(source.trusted, effects=effects)
    return Model(
        arm=source.arm.name,
        estimator="feasible",
        robot=source.arm.robot,
        terms=fitted.terms,
        delta=fitted.standard,
        moving=source.moving,
        base_parameters=_table(fitted),
        filter=Filter(
            cutoff_hz=windows.cutoff_hz,
            order=_ORDER,
            differentiation_cutoff_hz=MOTION_HZ,
            sign_cutoff_hz=DIRECTION_HZ[1],
            parallel=True,
            velocity_threshold_rad_s=float(slow[source.moving].max()),
        ),
        noise=_noise(source, fit),
        logs=tuple(d.name for d in source.datasets),
        effects=effects,
    )


def _table(fitted: Possible) -> tuple[BaseParameter, ...]:
    base = fitted.base
    beta = base.K @ fitted.standard
    return tuple(
        BaseParameter(name, unit, {"feasible": float(value)}, float(sd))
        for name, unit, value, sd in zip(base.names, base.units, beta, fitted.sd, strict=True)
    )


def _noise(source: Experiment, fit: Fit) -> Array:
    squares = (fit.sigma**2 * fit.counts).sum(axis=1) / np.maximum(fit.counts.sum(axis=1), 1)
    return np.where(source.moving, np.sqrt(squares), np.nan)


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


def simulation_of(model: Model) -> SimulatedArm:
    """The arm of a `model.yaml`, ready for the closed loop.

    Raises:
        DataError: an effect that the catalogue does not know, or an arm with too many joints.
    """
    friction, n = model.terms.drive_matrix, model.robot.dof
    arm = simulated_arm(
        chain_of(model.robot), model.inertial, model.parameter("fv"), model.parameter("fc")
    )
    arm = replace(arm, armature=friction.T @ np.diag(model.parameter("ia")) @ friction)
    terms = [Term(_offset, j, (float(c),)) for j, c in enumerate(model.parameter("fo")) if c]
    for m in np.flatnonzero(model.parameter("fcm")):
        arm = replace(
            arm,
            friction_rows=np.vstack([arm.friction_rows, friction[m]]),
            coulomb=np.append(arm.coulomb, model.parameter("fcm")[m]),
            bristle=np.append(arm.bristle, 0.0),
        )
    dragging = np.flatnonzero(model.parameter("fvm"))
    if len(dragging) and n >= SETTINGS:
        raise DataError(f"Drag on shared motors is simulated for at most {SETTINGS - 1} joints.")
    for m in dragging:
        drag = model.parameter("fvm")[m]
        for j in np.flatnonzero(friction[m]):
            settings = (float(drag * friction[m, j]), *(float(x) for x in friction[m]))
            terms.append(Term(_motor_drag, int(j), settings[: n + 1]))
    arm = replace(arm, terms=tuple(terms))
    for entry in model.effects:
        arm = _with_effect(arm, entry)
    return arm


def _with_effect(arm: SimulatedArm, entry: dict[str, Any]) -> SimulatedArm:
    hypothesis, values = effect_of(entry)
    return catalogue()[hypothesis.effect].simulated(arm, hypothesis, values)


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
