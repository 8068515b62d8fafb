"""What an arm with position servos is described by beside its links: one number a joint each."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """A number that each joint has.

    Attributes:
        name: in files and reports.
        unit: SI.
        low, high: bounds of a fit.
        first: where a fit begins unless something better is known.
        scale: a change that matters, in the unit; 0: the number is positive and fitted as its
            logarithm.
        text: what it is.
    """

    name: str
    unit: str
    low: float
    high: float
    first: float
    scale: float
    text: str


QUANTITIES = (
    Quantity("stiffness", "N m/rad", 1e-2, 1e5, 20.0, 0.0, "torque per position error"),
    Quantity("integral", "N m/(rad s)", 0.0, 1e5, 0.0, 1.0, "torque per integrated error"),
    Quantity("rate_gain", "N m s/rad", -50.0, 1e3, 0.0, 0.1, "torque per commanded speed"),
    Quantity("dead_zone", "rad", 0.0, 0.05, 0.0, 1e-3, "error that the servo leaves alone"),
    Quantity(
        "torque_limit",
        "N m",
        1e-2,
        1e4,
        1e4,
        0.0,
        "largest torque, at rest; damping is its speed line",
    ),
    Quantity("profile_speed", "rad/s", 5e-2, 1e3, 1e3, 0.0, "fastest that the servo plans"),
    Quantity("profile_acceleration", "rad/s^2", 0.5, 1e6, 1e6, 0.0, "hardest that it plans"),
    Quantity("delay", "s", 0.0, 0.3, 0.02, 5e-3, "from the command to the torque"),
    Quantity("armature", "kg m^2", 1e-6, 1e2, 0.02, 0.0, "inertia of the rotor, at the joint"),
    Quantity("damping", "N m s/rad", 1e-5, 1e3, 0.5, 0.0, "servo, back EMF and viscous friction"),
    Quantity("coulomb", "N m", 1e-6, 1e3, 0.1, 0.0, "dry friction"),
    Quantity("stribeck", "N m", 0.0, 1e3, 0.0, 0.05, "further dry friction at low speed"),
    Quantity("stribeck_speed", "rad/s", 5e-3, 1.0, 0.1, 0.0, "where that has fallen to 1/e"),
    Quantity(
        "stribeck_exponent", "1", 0.5, 4.0, 2.0, 0.0, "how it falls: 2 as a bell, 1 from a peak"
    ),
    Quantity("load_friction", "1", 0.0, 0.9, 0.0, 0.05, "dry friction per load"),
    Quantity("offset", "N m", -1e3, 1e3, 0.0, 0.05, "constant torque that resists"),
    Quantity("half_play", "rad", 0.0, 0.1, 0.0, 1e-3, "half the backlash of the gears"),
    Quantity("compliance", "rad/(N m)", 0.0, 1.0, 0.0, 2e-3, "twist of the gears per torque"),
    Quantity("zero", "rad", -3.2, 3.2, 0.0, 0.05, "model's position less the recorded one"),
    Quantity("spring", "N m/rad", 0.0, 1e4, 0.0, 0.05, "torque per angle that resists"),
    Quantity("drag", "N m s^2/rad^2", -1e3, 1e3, 0.0, 0.02, "friction per squared speed"),
    Quantity("skew", "N m s/rad", -1e3, 1e3, 0.0, 0.05, "half the damping's change by direction"),
    Quantity("turning_speed", "rad/s", 0.0, 0.2, 0.0, 0.005, "where dry friction is whole"),
    Quantity("presliding", "rad", 0.0, 0.05, 0.0, 5e-4, "path after which dry friction slips"),
    Quantity("rise_speed", "rad/s", 0.0, 0.2, 0.0, 0.002, "where half of it has risen further"),
    Quantity("gear_lag", "s", 0.0, 0.2, 0.0, 5e-3, "damper beside the twist: N m s per N m"),
    Quantity("link_friction", "1", 0.0, 1.0, 0.0, 0.1, "its part behind gears that give"),
    Quantity("speed_gain", "N m s/rad", 0.0, 1e4, 0.0, 0.1, "torque of the servo per speed"),
    Quantity("link_armature", "1", 0.0, 0.9, 0.0, 0.1, "armature's part behind gears that give"),
    Quantity("load_side", "1", 0.0, 1.0, 1.0, 1.0, "whose load: 1 the driving side, 0 the link"),
    Quantity("gravity_gain", "1", 0.0, 2.0, 0.0, 0.1, "part of the weight that is fed forward"),
    Quantity("integral_limit", "N m", 1e-3, 1e4, 1e4, 0.0, "largest torque of the integral"),
)
"""In the order of the rows of a settings array, shape (quantities, n)."""

LATER = {
    "spring": 0.0,
    "drag": 0.0,
    "skew": 0.0,
    "turning_speed": 0.0,
    "presliding": 0.0,
    "rise_speed": 0.0,
    "gear_lag": 0.0,
    "link_friction": 0.0,
    "speed_gain": 0.0,
    "link_armature": 0.0,
    "stribeck_exponent": 2.0,
    "load_side": 0.0,
    "gravity_gain": 0.0,
    "integral_limit": 1e4,
}
"""Quantities that files of the first version may lack, and what they were then."""

PER_STIFFNESS = (
    "integral",
    "rate_gain",
    "torque_limit",
    "integral_limit",
    "armature",
    "damping",
    "coulomb",
    "stribeck",
    "offset",
    "spring",
    "drag",
    "skew",
)
"""What a fit moves as a part of the stiffness: where a joint lifts too little, all torques may be
larger together, and the stiffness alone then stands for that."""

ROW = {quantity.name: i for i, quantity in enumerate(QUANTITIES)}
