"""Numbers, units, and names as a page prints them."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any

from ident.effects.events import CONTACT
from wamctl.arm.joint_labels import listed

Content = Mapping[str, Any]
"""Of a result file, or of a part of one."""

DASH = "–"
"""What stands where there is no number."""

_HARDLY = 0.9  # of the whole arm's error: what is left then says nothing of the effect
_LOWER = 1.02  # ratio of a joint's errors from which it falls, or rises
_PART = 0.5  # of what the whole arm's error tells: a smaller part of the gap is that of few joints
_NOTHING = 100.0  # error of no model at all [%]

_UNITS = {
    "kg m^2": "kg·m²",
    "kg m": "kg·m",
    "N m": "N·m",
    "N m s/rad": "N·m·s/rad",
    "N s/m": "N·s/m",
}

_ESTIMATORS = {
    "cad": "CAD",
    "ols": "OLS",
    "wls": "weighted LS",
    "irls": "robust LS",
    "iv": "instrumental variables",
    "feasible": "feasible",
    "feasible_wls": "feasible, weighted",
    "feasible_cad": "feasible, near CAD",
    "feasible_entropic": "feasible, entropic",
}

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def least_squares_text(content: Content) -> str:
    """What OLS is, by the method of a result."""
    if content.get("method") == "simulation":
        return "OLS: ordinary least squares of the simulated positions (output error)."
    return "OLS: ordinary least squares."


def known(value: float | None) -> bool:
    """Whether there is a number to print."""
    return value is not None and math.isfinite(value)


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return DASH
    if value == 0:
        return "0"
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    exponent = int(power)
    if exponent < -4 or exponent > 6:
        return _minus(f"{mantissa}·10{str(exponent).translate(_SUPERSCRIPTS)}")
    return fixed(value, max(digits - 1 - exponent, 0))


def fixed(value: float | None, decimals: int) -> str:
    """A number with so many decimals, thousands apart; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return DASH
    text = f"{value:z,.{decimals}f}"
    return _minus(text.replace(",", "\u202f"))


def whole(value: int | None) -> str:
    """A count, thousands apart."""
    return fixed(value, 0)


def setting(value: float | None) -> str:
    """A number that somebody chose, as it was chosen: without zeros behind it."""
    return _minus(f"{value:.6g}") if value is not None and math.isfinite(value) else DASH


def percent(value: float | None, digits: int = 3) -> str:
    """A percentage."""
    return f"{number(value, digits)}\u202f%" if known(value) else DASH


def share(value: float | None, digits: int = 3) -> str:
    """A share from 0 to 1 as a percentage."""
    return percent(None if value is None else 100 * value, digits)


def closed_share(value: float | None) -> str:
    """The part of a gap that is closed: all of it only where nothing is left."""
    return "over 99\u202f%" if value is not None and 0.99 < value < 1.0 else share(value, 2)


def with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    """A number and its unit."""
    return f"{number(value, digits)}\u202f{unit_text(unit)}" if known(value) else DASH


def decimals_of(sd: float | None) -> int:
    """Decimals that show two digits of a standard deviation."""
    if sd is None or not math.isfinite(sd) or sd <= 0:
        return 4
    return min(max(1 - int(f"{sd:.1e}".partition("e")[2]), 0), 9)


def plus_minus(value: float | None, sd: float | None, unit: str = "") -> str:
    """A value with its standard deviation, both to two digits of the latter."""
    if not known(value):
        return DASH
    if not known(sd) or sd == 0:
        return with_unit(value, unit) if unit else number(value)
    places = decimals_of(sd)
    text = f"{fixed(value, places)} ± {fixed(sd, places)}"
    return f"{text}\u202f{unit_text(unit)}" if unit else text


def unit_text(unit: str) -> str:
    """A unit with its dots and powers."""
    return _UNITS.get(unit, unit.replace("^2", "²").replace(" ", "·"))


def joint_units(torque: str) -> tuple[str, str]:
    """Of a joint whose torque has this unit, a force where it slides: torque and speed in print."""
    return unit_text(torque), "m/s" if torque == "N" else "rad/s"


def quantity_text(name: str) -> str:
    """A parameter of an effect in print."""
    words = {"half_play": "half the backlash", "link_armature": "rotor's part behind the gears"}
    return words.get(name, name.replace("_", " "))


def input_words(content: Content) -> list[str]:
    """The recordings behind a result file, and the arm where they do not carry it, as typed."""
    provenance = content.get("provenance", {})
    source = provenance.get("arm", {}).get("described in", ":")
    inside = ":" in source  # RECORDING:FILE
    return [
        *(list(provenance.get("logs", ())) or ["LOG.mcap"]),
        *([] if inside else ["--robot", source]),
    ]


def estimator_text(name: str) -> str:
    """An estimator's name in print."""
    return _ESTIMATORS.get(name, name.replace("_", " "))


def _minus(text: str) -> str:
    return text.replace("-", "−")


def effect_text(effect: str, joints: Sequence[int]) -> str:
    """An effect and its joints in a figure, where room is scarce."""
    where = "all joints" if not joints else f"joint{'s' * (len(joints) > 1)} {_numbers(joints)}"
    return f"{effect.replace('_', ' ')}, {where}"


def kinds_text(
    effects: Sequence[Content],
    title: Callable[[str], str],
    of: Callable[[Sequence[int]], str],
) -> list[str]:
    """Effects with their joints; what is of one kind at several joints is told once.

    Args:
        effects: of `gap.json`.
        title: of an effect's name.
        of: joints, from 1, in a sentence.
    """
    kinds: dict[tuple[str, tuple[int, ...]], list[Sequence[int]]] = {}
    for e in effects:
        alone = len(e["joints"]) == 1 or e["name"] == CONTACT.id
        kinds.setdefault((e["name"], () if alone else tuple(e["joints"])), []).append(e["joints"])
    told = []
    for (name, shared), places in kinds.items():
        several = len(places) > len({tuple(p) for p in places}) or (
            name == CONTACT.id and len(places) > 1
        )
        text = f"{title(name)} at {of(sorted(set(chain.from_iterable(places))))}"
        text += " alike" * (len(shared) > 2)
        told.append(text + (f" ({len(places)} of this kind)" if several else ""))
    return told


def _numbers(joints: Sequence[int]) -> str:
    """Joints, from 1, as 2 and 4, or as 1-7."""
    whole = list(range(joints[0], joints[-1] + 1)) == list(joints)
    if whole and len(joints) > 2:
        return f"{joints[0]}\u2013{joints[-1]}"
    return listed([str(j) for j in joints])


def part_of_what_is_missing(closed: float | None) -> str:
    """The share of a gap that named effects close, as a sentence begins that tells of the rest."""
    most = closed is not None and closed > 0.5
    return f"{'Most' if most else 'Part'} of what the model misses"


def closed_text(held_out: Content, of: Callable[[Sequence[int]], str], count: int = 1) -> str:
    """What effects do to the error on held-out data; nothing where it is not known.

    Args:
        held_out: of `gap.json`.
        of: joints, from 1, in a sentence.
        count: number of effects.
    """
    sides = [held_out[k] for k in ("before", "after")]
    before, after = (side["relative_error_percent"] for side in sides)
    if not known(before) or not known(after):
        return ""
    where, rises, texts = "", "", [percent(before), percent(after)]
    it = "it" if count == 1 else "them"
    if after > _HARDLY * before:  # a light joint, which the whole arm's error does not show
        pairs = list(zip(*(side["rms_by_joint"] for side in sides), strict=True))
        ratios = [old / new if known(old) and new else 0.0 for old, new in pairs]
        best = ratios.index(max(ratios))
        if ratios[best] < _LOWER:
            return (
                f"Adding {it} does not lower the error on held-out data ({texts[0]} before,"
                f" {texts[1]} after).{_other_motion(held_out)}"
            )
        worst = min(range(len(ratios)), key=lambda j: ratios[j] or math.inf)
        where = f" of {of([best + 1])}"
        texts = [with_unit(x, "N m") for x in pairs[best]]
        if _LOWER * ratios[worst] < 1.0:
            old, new = (with_unit(x, "N m") for x in pairs[worst])
            rises = f", and that of {of([worst + 1])} rises from {old} to {new}"
        if after > _LOWER * before:
            rises += f"; that of the whole arm rises from {percent(before)} to {percent(after)}"
    closed, share = closed_share(held_out["closed_fraction"]), held_out["closed_fraction"]
    if not where and known(share) and share < _PART * (1.0 - (after / before) ** 2):
        return (
            f"Adding {it} lowers the error on held-out data from {texts[0]} to {texts[1]}, but"
            f" closes {closed} of the gap at the joints that keep structure."
            f"{_other_motion(held_out)}"
        )
    return (
        f"Adding {it} closes {closed} of the gap: on held-out data, the error{where} falls from"
        f" {texts[0]} to {texts[1]}{rises}.{_other_motion(held_out)}"
    )


def _other_motion(held_out: Content) -> str:
    """What may be expected of another motion."""
    others = held_out.get("other_recordings", {})
    sides = [others.get(k, {}).get("relative_error_percent") for k in ("before", "after")]
    if not all(known(x) for x in sides):
        return (
            " The held-out part is of the same motion; record another one to see what carries over."
        )
    if max(sides) > _NOTHING:
        return (
            " Predicted by fits to the others, a recording is not explained at all: each tells the"
            " arm's parameters too little by itself."
        )
    return (
        f" On each recording, predicted by fits to the others, it goes from {percent(sides[0])} to"
        f" {percent(sides[1])}: by this measure, about that may be expected of another motion."
    )
