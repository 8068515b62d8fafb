"""Effects that the simulation can hold, under their names in the catalogue."""

from dataclasses import dataclass

from ident.output_error.search import parts
from ident.output_error.search.parts import Part

_GIVE = ("compliance", "lag", "link_armature")
_BEHIND = "link_armature of the rotor's inertia is the link's"


@dataclass(frozen=True)
class EffectKind:
    """An effect as the simulation holds it.

    Attributes:
        name: id in the catalogue.
        part: what it adds to a joint.
        reported: name of each of its quantities in the result file.
        reported_form: the same of the quantity that says which form it has; empty: it has one.
        equation: how the simulation forms it.
    """

    name: str
    part: Part
    reported: tuple[str, ...]
    equation: str
    reported_form: str = ""


KINDS = (
    EffectKind("encoder_offset", parts.ENCODER_OFFSET, ("offset",), "q_j = q_read,j + offset"),
    EffectKind(
        "stribeck",
        parts.STRIBECK,
        ("extra_friction", "speed"),
        "tau_j += extra_friction exp(-(|qd_j|/speed)^exponent) sgn(qd_j)",
        "exponent",
    ),
    EffectKind(
        "load_dependent_friction",
        parts.LOAD_FRICTION,
        ("coefficient",),
        "tau_j += coefficient (|tau_link,j| + driving_side max(|tau_motor,j| - |tau_link,j|, 0))"
        " sgn(qd_j), tau_link,j by gravity and speeds",
        "driving_side",
    ),
    EffectKind(
        "backlash",
        parts.HALF_PLAY,
        ("half_play", *_GIVE),
        "no torque passes the gears while |q_rotor,j - q_j| < half_play (half the backlash); by d"
        f" farther, d + lag dd/dt = compliance tau_j; {_BEHIND}",
    ),
    EffectKind(
        "joint_elasticity",
        parts.COMPLIANCE,
        _GIVE,
        f"q_rotor,j - q_j + lag d(q_rotor,j - q_j)/dt = compliance tau_j; {_BEHIND}",
    ),
    EffectKind("torque_offset", parts.OFFSET, ("offset",), "tau_j += offset"),
    EffectKind(
        "joint_spring",
        parts.SPRING,
        ("stiffness", "torque_at_zero"),
        "tau_j += stiffness q_j + torque_at_zero",
    ),
    EffectKind("nonlinear_viscous", parts.DRAG, ("drag",), "tau_j += drag qd_j |qd_j|"),
    EffectKind(
        "asymmetric_viscous",
        parts.SKEW,
        ("half_difference",),
        "tau_j += half_difference |qd_j|",
    ),
)
"""In the order of the report."""

KIND_OF = {kind.part: kind for kind in KINDS}
"""The effect that a part is; a servo's own parts are none."""


def effect_name(part: Part) -> str:
    """Id in the catalogue, or the name of a servo's part."""
    return KIND_OF[part].name if part in KIND_OF else part.name


NOT_ASKED = {
    "rotor_inertia": "every servo model has it",
    "torque_delay": "every servo model has it",
    "torque_saturation": "a servo's torque limit is a part of the servo",
    "torque_gain": "the servo's stiffness takes it",
    "payload": "it needs a model that was trusted before",
    "gravity_tilt": "zeros and offsets of the joints take it",
    "torque_ripple": "not built into the simulation yet",
    "presliding": "every servo model has it",
    "thermal_drift": "the simulated friction does not change with time",
    "coupled_friction": "each joint has a servo of its own",
    "coupled_inertia": "each joint has a servo of its own",
    "contact": "the simulation knows no outside",
    "dropped_samples": "positions are not searched for lost or repeated samples",
}
"""Effects of the catalogue that this search does not ask for, and why."""
