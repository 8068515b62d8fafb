"""The named effects of a model with their equations: from `model.yaml`, and back."""

import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from ident.dynamics.compiled_chain import chain_of, torques
from ident.dynamics.regressor import Motion
from ident.effects.candidate import Candidate, fields_of
from ident.effects.catalogue import catalogue
from ident.effects.effect import Effect
from ident.effects.observation import ArmFacts, Observed
from ident.model.identified_model import Model
from ident.model.model_file import read_model
from ident.model.records import EffectRecord
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

Member = tuple[Candidate, Array]


@dataclass(frozen=True)
class BoundEffects:
    """Effects of a model.

    Attributes:
        members: each effect with its coefficients, shape (k,).
    """

    members: tuple[tuple[Candidate, Array], ...]

    @property
    def records(self) -> tuple[EffectRecord, ...]:
        """The effects as `model.yaml` holds them."""
        return tuple(_record(candidate, values) for candidate, values in self.members)

    def torque(self, model: Model, motion: Motion, period_s: float | None) -> Array:
        """Torque beside the rigid bodies and their friction [N m], shape (S, n)."""
        return effect_torque(model, self.members, motion, period_s)


def load_model(path: Path | str) -> Model:
    """The model of a `model.yaml`.

    Raises:
        ConfigurationError: no such file, or not valid YAML, or faults in its content.
        DataError: not a model file, or of a later version, or an effect that is not known.
    """
    return read_model(path, bound)


def bound(records: Sequence[EffectRecord]) -> BoundEffects:
    """Effects with their equations.

    Raises:
        DataError: an effect that the catalogue does not know, or that is not complete.
    """
    return BoundEffects(tuple(_member(record) for record in records))


def members_of(model: Model) -> tuple[tuple[Candidate, Array], ...]:
    """A model's effects, each with its coefficients, shape (k,).

    Raises:
        DataError: an effect that the catalogue does not know, or that is not complete.
    """
    effects = model.effects
    return effects.members if isinstance(effects, BoundEffects) else bound(effects.records).members


def _record(candidate: Candidate, values: Array) -> EffectRecord:
    coefficients = candidate.coefficients
    used = {n: v for n, v in fields_of(candidate.parameters).items() if v is not None}
    return EffectRecord(
        name=candidate.effect,
        joints=tuple(j + 1 for j in candidate.joints),
        equation=catalogue()[candidate.effect].equation_of(candidate),
        variant=candidate.variant,
        parameters={c.name: float(v) for c, v in zip(coefficients, values, strict=True)},
        units={c.name: c.unit for c in coefficients},
        settings={name: _listed(value) for name, value in used.items()},
        rows=tuple(j + 1 for j in candidate.rows),
    )


def _listed(value: Any) -> Any:
    return [_listed(x) for x in value] if isinstance(value, tuple) else value


def _member(record: EffectRecord) -> tuple[Candidate, Array]:
    effects, name = catalogue(), record.name
    if name not in effects:
        known = ", ".join(effects)
        raise DataError(f"The model holds an effect {name!r}; this program knows {known}.")
    joints, rows = ([j - 1 for j in numbers] for numbers in (record.joints, record.rows))
    parameters = _read(effects[name], record.settings)
    try:
        candidate = effects[name].at(joints, parameters, record.variant, rows)
    except KeyError as error:
        raise DataError(
            f"The model's effect {name} has a variant {record.variant!r} that is not known."
        ) from error
    return candidate, _values(candidate, record.parameters)


def _read(effect: Effect, settings: Mapping[str, Any]) -> Any:
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


def _values(candidate: Candidate, parameters: Mapping[str, float]) -> Array:
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
    return np.array([parameters[name] for name in names])


def checked_model(given: object) -> Model:
    """What was given, if it is a model.

    Raises:
        DataError: it is something else.
    """
    if isinstance(given, Model):
        return given
    raise DataError(
        f"model is {reprlib.repr(given)}, not an ident.Model; ident.load_model(path) reads one, and"
        " the results of identify and find_gap hold one as `.model`."
    )


def effect_torque(
    model: Model, members: Sequence[Member], motion: Motion, period_s: float | None
) -> Array:
    """Torque of effects beside rigid bodies and friction [N m], shape (S, n).

    First those on the links, then those that the drive has, and last those that need the whole
    torque: a delay, a clipped command, a share of it.

    Args:
        model: the arm.
        members: its effects, each with its coefficients.
        motion: S samples.
        period_s: between samples that follow each other [s]; None: each stands alone, and an
            effect with a memory is as it is after a long time at this speed.
    """
    total = np.zeros_like(motion.q)
    if not members:
        return total
    seen, still = _observation(model, motion, period_s), period_s is None
    for stage in range(3):
        added = np.zeros_like(total)
        for candidate, values in members:
            if _stage(candidate) == stage:
                effect = catalogue()[candidate.effect]
                form = effect.static_columns if still else effect.columns
                added[:, list(candidate.rows)] += form(seen, candidate) @ values
        total += added
        carried = total if stage == 0 else seen.carried
        seen = replace(seen, carried=carried, tau=seen.tau + added)
    return total


def _stage(candidate: Candidate) -> int:
    effect = catalogue()[candidate.effect]
    if effect.acts_on_link:
        return 0
    return 2 if "torque" in effect.depends_on else 1


def _observation(model: Model, motion: Motion, period_s: float | None) -> Observed:
    """What the model says about a motion, as effects look at it; friction turns round at once."""
    chain, delta = chain_of(model.robot), model.inertial
    q, qd, qdd = (np.ascontiguousarray(x) for x in (motion.q, motion.qd, motion.qdd))
    rest = np.zeros_like(q)
    load, gravity = torques(chain, delta, q, qd, qdd), torques(chain, delta, q, rest, rest)
    viscous, coulomb, direction = model.parameter("fv"), model.parameter("fc"), np.sign(qd)
    tau = load + viscous * qd + coulomb * direction
    n, step = model.robot.dof, period_s or 1.0
    facts = ArmFacts(
        chain=chain,
        delta=delta,
        motor_from_joint=None,
        moving=model.moving,
        pose=q.mean(axis=0),
        peak_torque=np.abs(tau).max(axis=0, initial=0.0),
        duration_s=len(q) * step,
        commanded=False,
    )
    return Observed(
        arm=facts,
        rate_hz=1.0 / step,
        t=np.arange(len(q)) * (0.0 if period_s is None else step),
        q=q,
        qd=qd,
        qdd=qdd,
        tau=tau,
        speed=qd,
        direction=direction,
        load=load,
        carried=np.zeros((len(q), n)),
        gravity=gravity,
        viscous=viscous,
        coulomb=coulomb,
        along=lambda _, speed: np.sign(speed),
    )
