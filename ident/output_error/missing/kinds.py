"""Effects that the simulation can hold, under their names in the catalogue."""

from dataclasses import dataclass

from ident.output_error.selection import PARTS, Part


@dataclass(frozen=True)
class EffectKind:
    """An effect as the simulation holds it.

    Attributes:
        name: id in the catalogue.
        part: its quantities, the deciding one first, and sizes to begin with.
        reported: name of each quantity in the result file.
        equation: how the simulation forms it.
    """

    name: str
    part: Part
    reported: tuple[str, ...]
    equation: str

    @property
    def felt_elsewhere(self) -> bool:
        """Whether it moves other joints too, as a zero that turns their gravity."""
        return self.part.name == "zero"

    @property
    def further(self) -> int:
        """Quantities beside the deciding one."""
        return len(self.part.quantities) - 1


KINDS = (
    EffectKind(
        "encoder_offset",
        Part("zero", ("zero",), (-0.2, -0.05, 0.05, 0.2)),
        ("offset",),
        "q_j = q_read,j + offset",
    ),
    EffectKind(
        "stribeck",
        Part("stribeck", ("stribeck", "stribeck_speed"), (0.1, 0.3, 0.8), "coulomb"),
        ("extra_friction", "speed"),
        "tau_j += extra_friction exp(-(qd_j/speed)^2) sgn(qd_j)",
    ),
    EffectKind(
        "load_dependent_friction",
        Part("load_friction", ("load_friction",), (0.05, 0.15, 0.4)),
        ("coefficient",),
        "tau_j += coefficient |tau_gravity,j| sgn(qd_j)",
    ),
    EffectKind(
        "backlash",
        Part("half_play", ("half_play",), (1e-3, 2e-3, 4e-3, 8e-3, 0.016), instead="coulomb"),
        ("half_play",),
        "no torque passes the gears while |q_rotor,j - q_j| < half_play (half the backlash)",
    ),
    EffectKind(
        "joint_elasticity",
        Part("compliance", ("compliance",), (2e-3, 8e-3, 0.03)),
        ("compliance",),
        "q_rotor,j - q_j = compliance tau_j",
    ),
    EffectKind(
        "torque_offset",
        Part("offset", ("offset",), (-3.0, -1.0, -0.3, 0.3, 1.0, 3.0), "coulomb"),
        ("offset",),
        "tau_j += offset",
    ),
    EffectKind(
        "joint_spring",
        Part("spring", ("spring", "offset"), (0.3, 1.0, 3.0, 10.0), "coulomb"),
        ("stiffness", "torque_at_zero"),
        "tau_j += stiffness q_j + torque_at_zero",
    ),
    EffectKind(
        "nonlinear_viscous",
        Part("drag", ("drag",), (-0.1, 0.1, 0.3, 1.0), "damping"),
        ("drag",),
        "tau_j += drag qd_j |qd_j|",
    ),
    EffectKind(
        "asymmetric_viscous",
        Part("skew", ("skew",), (-0.5, -0.15, 0.15, 0.5), "damping"),
        ("half_difference",),
        "tau_j += half_difference |qd_j|",
    ),
)
"""In the order of the report."""

SERVO_PARTS = tuple(
    p for p in PARTS if p.name in ("profile", "torque_limit", "rate_gain", "profile_speed")
)
"""What belongs to a servo and is fitted before any effect is asked for."""

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
