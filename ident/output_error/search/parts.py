"""What a joint may have beside gain, damping, rotor, dry friction, and delay."""

from dataclasses import dataclass, replace

TURNING = ("turning_speed", "presliding", "rise_speed")
"""How dry friction turns round: nobody knows, so that it is fitted at every joint."""

BASE = ("stiffness", "armature", "damping", "coulomb", *TURNING, "delay")
"""What every joint has."""


@dataclass(frozen=True)
class Part:
    """Something that a servo, its gears, or its link may have.

    Attributes:
        name: in arms' files and reports.
        quantities: what it adds, the deciding one first.
        sizes: of the deciding one, to begin with; empty: where it is.
        relative: quantity that the sizes are parts of.
        servo: whether it belongs to the servo, and is looked for before all else.
        common: whether joints have it all or none, as servos of one kind do.
        gears: whether servos of one kind may all have it in their gears; a joint may have it by
            itself, too.
        beside: quantity without which it is nothing.
        instead: quantity that a fit without the part makes larger, or smaller, since it lags, or
            holds, alike.
        shares: of that quantity, with which the part is tried.
        form: quantity that is no size, and says which of its forms the part has.
        forms: its values, in order.
        unlike: whether these differ so much that each is fitted where the part is tried.
    """

    name: str
    quantities: tuple[str, ...]
    sizes: tuple[float, ...] = ()
    relative: str = ""
    servo: bool = False
    common: bool = False
    gears: bool = False
    beside: str = ""
    instead: str = ""
    shares: tuple[float, ...] = (1.0, 0.5, 0.1)
    form: str = ""
    forms: tuple[float, ...] = ()
    unlike: bool = False

    @property
    def felt_elsewhere(self) -> bool:
        """Whether it moves other joints too, as a zero that turns their gravity."""
        return "zero" in self.quantities

    @property
    def further(self) -> int:
        """Quantities beside the deciding one."""
        return len(self.quantities) - 1


ZEROS = Part("zero", ("zero",), servo=True, common=True)
"""Of all joints: the pose in which the arm's positions are nothing."""

SERVO_PARTS = (
    Part(
        "profile",
        ("profile_acceleration",),
        (3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0),
        servo=True,
        common=True,
        instead="armature",
    ),
    Part(
        "torque_limit", ("torque_limit",), (0.03, 0.06, 0.09, 0.12, 0.17, 0.25), "stiffness", True
    ),
    Part("rate_gain", ("rate_gain",), (0.15, 0.4, 0.8), "damping", True, True),
    Part("profile_speed", ("profile_speed",), (0.5, 1.0, 2.0, 4.0), "", True, True),
    Part("integral", ("integral",), (0.3, 1.0, 4.0), "stiffness", True, True),
    Part(
        "integral_limit",
        ("integral_limit",),
        (0.01, 0.02, 0.03, 0.04, 0.06, 0.1),
        "stiffness",
        True,
        beside="integral",
    ),
    Part("gravity_gain", ("gravity_gain",), (0.5, 1.0), "", True, True, instead="stiffness"),
    Part("dead_zone", ("dead_zone",), (2e-3, 5e-3), "", True, True),
)

ENCODER_OFFSET = Part("encoder_offset", ("zero",), (-0.2, -0.05, 0.05, 0.2))
LOAD_FRICTION = Part(
    "load_friction",
    ("load_friction",),
    (0.05, 0.15, 0.4),
    form="load_side",
    forms=(1.0, 0.0),
    unlike=True,
)
STRIBECK = Part(
    "stribeck",
    ("stribeck", "stribeck_speed"),
    (0.1, 0.3, 0.8, 2.0),
    "coulomb",
    form="stribeck_exponent",
    forms=(0.7, 1.0, 2.0),
)
GIVE = ("compliance", "gear_lag", "link_armature")
"""Of gears that let rotor and link move apart: their teeth are springs with a damper, and a part of
what turns is behind them."""

HALF_PLAY = Part(
    "half_play", ("half_play", *GIVE), (1e-3, 2e-3, 4e-3, 8e-3, 0.016), instead="coulomb"
)
COMPLIANCE = Part("compliance", GIVE, (2e-3, 8e-3, 0.03))
OFFSET = Part("offset", ("offset",), (-3.0, -1.0, -0.3, 0.3, 1.0, 3.0), "coulomb")
SPRING = Part("spring", ("spring", "offset"), (0.3, 1.0, 3.0, 10.0), "coulomb")
DRAG = Part("drag", ("drag",), (-0.1, 0.1, 0.3, 1.0), "damping")
SKEW = Part("skew", ("skew",), (-0.5, -0.15, 0.15, 0.5), "damping")

PARTS = (
    ZEROS,
    *SERVO_PARTS,
    *(replace(p, gears=True) for p in (LOAD_FRICTION, STRIBECK, HALF_PLAY, COMPLIANCE)),
    OFFSET,
)
"""What an identification looks for; a search for names asks of gears joint by joint only."""
