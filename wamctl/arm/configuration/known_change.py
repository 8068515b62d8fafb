"""What an operator has done to an arm between two motions, in numbers or in a word."""

import math
from dataclasses import dataclass

from wamctl.arm.errors import UserError

WORDS = (
    "load=KG,X,Y,Z (a mass at the tool, its centre in the last link's parameter frame [m]), "
    "tilt=X,Y (the base turned about its x and y axes [deg]), "
    "again (the arm is as it was: warmed up, or its zero found anew)"
)

_MOST_KG, _MOST_M, _MOST_DEG = 200.0, 2.0, 45.0


class KnownChangeError(UserError):
    """A text that tells no change of an arm."""

    exit_code = 2

    def __init__(self, text: str, why: str) -> None:
        super().__init__(text, why)
        self.text, self.why = text, why

    def __str__(self) -> str:
        return f"{self.text!r} tells no change of the arm ({self.why}): say {WORDS}."


@dataclass(frozen=True)
class KnownChange:
    """A change whose size is known.

    Attributes:
        load: mass [kg], and its centre in the last link's parameter frame [m]; zeros: none.
        tilt_rad: how far the base is turned about its own x axis, then about its own y axis [rad].
    """

    load: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    tilt_rad: tuple[float, float] = (0.0, 0.0)

    @property
    def alters_the_model(self) -> bool:
        """Whether torque is another one for the same motion."""
        return self != KnownChange()


def known_change(text: str) -> KnownChange:
    """The change that an operator's answer tells.

    Raises:
        KnownChangeError: it tells none.
    """
    kind, _, rest = text.strip().partition("=")
    if kind == "again" and not rest:
        return KnownChange()
    wanted = {"load": 4, "tilt": 2}.get(kind)
    if wanted is None:
        raise KnownChangeError(text, "no such kind")
    try:
        numbers = tuple(float(part) for part in rest.split(","))
    except ValueError as error:
        raise KnownChangeError(text, "not numbers between commas") from error
    if len(numbers) != wanted or not all(map(math.isfinite, numbers)):
        raise KnownChangeError(text, f"{wanted} finite numbers are wanted")
    if kind == "tilt":
        if not 0.0 < max(map(abs, numbers)) <= _MOST_DEG:
            raise KnownChangeError(text, f"above 0 and up to {_MOST_DEG:g} deg")
        x, y = map(math.radians, numbers)
        return KnownChange(tilt_rad=(x, y))
    mass, px, py, pz = numbers
    if not (0.0 < mass <= _MOST_KG and max(map(abs, (px, py, pz))) <= _MOST_M):
        raise KnownChangeError(text, f"up to {_MOST_KG:g} kg, and {_MOST_M:g} m")
    return KnownChange(load=(mass, px, py, pz))
