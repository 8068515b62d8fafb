"""What a format has no place for, and how much torque that is."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace

import numpy as np

from ident.dynamics.regressor import Motion
from ident.effects.bound_effects import BoundEffects, members_of
from ident.effects.catalogue import catalogue
from ident.effects.simulated_model import without_effects
from ident.model.identified_model import Model, NoEffects
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm, Term

_SECONDS = 10.0
_PERIOD_S = 0.004
_LARGEST = 0.5  # rad: of a joint's wave
_RANGE = 0.25  # of the joint's range: the same


@dataclass(frozen=True)
class ExportedArm:
    """The identified arm with its effects, as far as formulas of one sample can say them.

    Attributes:
        model: the identified model.
        arm: links, gravity, rotors, friction, encoder offsets and gains with the effects' in them.
        terms: further torques of the effects.
    """

    model: Model
    arm: SimulatedArm
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class LeftOut:
    """What a format does not hold.

    Attributes:
        what: in words.
        rms: torque that is missing [N m], along sine waves through the middle of the joints'
            ranges, at the joint with the most of it.
    """

    what: str
    rms: float

    def __str__(self) -> str:
        return f"{self.what} ({self.rms:.2g} N m rms)"


def exported_arm(model: Model) -> ExportedArm:
    """The model as exports write it.

    Raises:
        DataError: an effect that is not known.
    """
    plain = without_effects(model)
    arm = plain
    for candidate, values in members_of(model):
        arm = catalogue()[candidate.effect].simulated(arm, candidate, values)
    return ExportedArm(model, arm, arm.terms[len(plain.terms) :])


def effects_left_out(
    model: Model, held: Iterable[str], writes: Callable[[Term], bool]
) -> list[LeftOut]:
    """Effects that a format holds in part or not at all.

    Args:
        model: the identified model.
        held: fields of `SimulatedArm` that the format has a place for.
        writes: whether it can write a further torque.
    """
    known, found = set(held), []
    plain = without_effects(model)
    for candidate, values in members_of(model):
        arm = catalogue()[candidate.effect].simulated(plain, candidate, values)
        changed = {f.name for f in fields(arm) if _differs(plain, arm, f.name)}
        texts = [writes(term) for term in arm.terms[len(plain.terms) :]]
        if changed <= known and all(texts):
            continue
        alone = replace(model, effects=BoundEffects(((candidate, values),)))
        partly = bool(changed & known) or any(texts)
        joints = ", ".join(model.robot.joint_names[j] for j in candidate.joints)
        what = f"effect {candidate.effect} of {joints}" + (", in part" if partly else "")
        found.append(LeftOut(what, _rms(_missing(alone, partly))))
    return found


def parameters_left_out(model: Model, kinds: dict[str, tuple[str, ...]]) -> list[LeftOut]:
    """Kinds of parameters without a place, by their name in words."""
    bare, found = replace(model, effects=NoEffects()), []
    for what, out in kinds.items():
        gone = np.array([p.kind in out for p in model.parameters])
        if np.any(model.delta[gone]):
            less = replace(bare, delta=np.where(gone, 0.0, bare.delta))
            found.append(LeftOut(what, _rms(_torque(bare, None) - _torque(less, None))))
    return found


def sentence(format_name: str, items: list[LeftOut]) -> list[str]:
    """What is missing, as one sentence without its full stop; none where nothing is."""
    if not items:
        return []
    told = ", ".join(str(x) for x in items)
    return [f"left out, since {format_name} has no place for it: {told}"]


def typical_motion(model: Model) -> Motion:
    """Sine waves of all joints about the middle of their ranges, from rest."""
    lower, upper = model.robot.model.lowerPositionLimit, model.robot.model.upperPositionLimit
    bounded = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 2 * np.pi)
    middle = np.where(bounded, (np.nan_to_num(lower) + np.nan_to_num(upper)) / 2, 0.0)
    size = np.where(bounded, np.minimum(_RANGE * np.nan_to_num(upper - lower), _LARGEST), _LARGEST)
    t = np.arange(0.0, _SECONDS, _PERIOD_S)[:, None]
    w = 2 * np.pi * np.linspace(0.2, 0.5, model.robot.dof)
    q = middle + size * (1.0 - np.cos(w * t)) - size
    return Motion(q, size * w * np.sin(w * t), size * w**2 * np.cos(w * t))


def _missing(alone: Model, partly: bool) -> Array:
    whole = _torque(alone, _PERIOD_S) - _torque(replace(alone, effects=NoEffects()), None)
    if not partly:
        return whole
    return _torque(alone, _PERIOD_S) - _torque(alone, None)


def _torque(model: Model, dt: float | None) -> Array:
    motion = typical_motion(model)
    return model.inverse_dynamics(motion.q, motion.qd, motion.qdd, dt)


def _rms(torque: Array) -> float:
    return float(np.sqrt((torque**2).mean(axis=0)).max())


def _differs(first: SimulatedArm, second: SimulatedArm, name: str) -> bool:
    a, b = getattr(first, name), getattr(second, name)
    if name == "chain":
        return not np.array_equal(a.gravity, b.gravity)
    if name == "bristle":  # elements that stick rigidly have none
        a, b = a[a != 0.0], b[b != 0.0]
    return name != "terms" and not np.array_equal(a, b)
