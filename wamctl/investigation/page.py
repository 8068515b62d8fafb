"""The notebook of an investigation: one self-contained page, written after every round."""

import math
from collections.abc import Sequence
from functools import cache
from math import floor, log10
from statistics import median
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from wamctl.investigation.evidence import odds_text, words

_BAR = 7  # px, of one block's outcome
_HALF = 24  # px, of the largest outcome
_WIDE, _HIGH = 420.0, 130.0  # px, of a measured curve
_ZERO = {"value": 0.0, "sd": 0.0}
_LOW = 100.0  # px, of a figure of measured over predicted torque, which is twice as wide
_SMALL = 0.1  # of a unit: smaller sizes are told in thousandths
_LEAST = 1e-12  # N m: a curve that is zero everywhere is drawn as well

_BOUNDS = {
    "wall_s": "time on the clock [s]",
    "motion_s": "time of motion [s]",
    "energy_j": "work of the motors [J]",
    "motor_load": "rms torque of the most loaded motor [its continuous torque]",
    "stops": "runs that a limit ended",
    "motions": "motions after the first",
    "answers": "answers of the operator",
}


def page(
    content: dict[str, Any], sentence: str, advice: str, seen: Sequence[dict[str, Any]]
) -> str:
    """The page of an `investigation.json`.

    Args:
        content: its content.
        sentence: the verdict in a sentence.
        advice: the command that comes next.
        seen: of each round, what was measured and predicted beyond a rival, by rival.
    """
    rounds = [
        r
        | {"likely": _likely(r["odds"]), "drawn": _drawn(r["bets"])}
        | {"seen": {rival: _beyond(curves) for rival, curves in found.items()}}
        for r, found in zip(content["rounds"], seen, strict=True)
    ]
    effects = [e | {"drawn": _curve(e)} if "depends_on" in e else e for e in content["effects"]]
    used = content["budget"]["used"] | {
        "wall_s": content["wall_s"],
        "motions": max(0, len([r for r in rounds if not r["changed"]]) - 1),
        "answers": len([r for r in rounds if r["changed"]]),
    }
    declared = content["budget"]["declared"]
    budget = [(_BOUNDS[name], used[name], most) for name, most in declared.items()]
    return _template().render(
        content=content | {"effects": effects},
        sentence=sentence,
        rounds=rounds,
        budget=budget,
        hidden=_hidden(content["minimum_detectable"], content["detectable_units"]),
        next=advice,
    )


def _likely(odds: dict[str, float]) -> list[tuple[str, float]]:
    return sorted(odds.items(), key=lambda item: -item[1])


def _drawn(bets: dict[str, list[float]]) -> dict[str, list[dict[str, float]]]:
    """Bars of each block's outcome: up where the leader predicted better."""
    return {
        rival: [
            {"x": k * _BAR, "y": _HALF - max(b, 0.0) * _HALF, "height": max(abs(b) * _HALF, 0.5)}
            for k, b in enumerate(_between_ends(won))
        ]
        for rival, won in bets.items()
    }


def _between_ends(values: list[float]) -> list[float]:
    """Each value between -1 and 1: half where it is as large as their rms."""
    usual = math.sqrt(sum(v**2 for v in values) / max(len(values), 1)) or 1.0
    return [v / (abs(v) + usual) for v in values]


def _curve(effect: dict[str, Any]) -> dict[str, Any]:
    """A measured curve as points [px], with its band of two standard deviations.

    A corner that is not told is zero, but for the last of a curve that comes again, its first.
    """
    told = effect["parameters"]
    known = [told.get(f"at_{k + 1}", _ZERO) for k in range(effect["corners"])]
    if "at_1" in told:
        known[-1] = told.get(f"at_{len(known)}", known[0])
    size, band = [v["value"] for v in known], [2.0 * v["sd"] for v in known]
    low = min(0.0, *(y - b for y, b in zip(size, band, strict=True)))
    high = max(0.0, *(y + b for y, b in zip(size, band, strict=True)))
    across, up = _WIDE / max(len(size) - 1, 1), _HIGH / max(high - low, _LEAST)

    def path(values: list[float]) -> list[str]:
        return [f"{k * across:.1f},{(high - y) * up:.1f}" for k, y in enumerate(values)]

    above = path([y + b for y, b in zip(size, band, strict=True)])
    below = path([y - b for y, b in zip(size, band, strict=True)])
    joined = {"line": " ".join(path(size)), "band": " ".join([*above, *reversed(below)])}
    return joined | {
        "zero": high * up,
        "low": low,
        "high": high,
        "unit": next(iter(told.values()))["unit"],
    }


def _beyond(found: dict[str, Any]) -> dict[str, Any]:
    """Measured torque over what was predicted beyond a rival, with two standard deviations [px]."""
    predicted, measured, sd = found["predicted_nm"], found["measured_nm"], found["sd_nm"]
    ends = [abs(y) + 2.0 * s for y, s in zip(measured, sd, strict=True)]
    wide = max(_LEAST, *map(abs, predicted))
    high = max(wide, *ends)

    def up(torque: float) -> float:
        return (1.0 - torque / high) * _LOW / 2.0

    points = [
        {
            "x": (1.0 + x / wide) * _LOW,
            "y": up(y),
            "above": up(y + 2.0 * s),
            "below": up(y - 2.0 * s),
        }
        for x, y, s in zip(predicted, measured, sd, strict=True)
    ]
    line = {"low": up(-wide), "high": up(wide)}
    sizes = {"wide": with_unit(wide, "N m"), "tall": with_unit(high, "N m")}
    return {"joint": found["joint"], "points": points} | line | sizes


def _hidden(
    sizes: dict[str, dict[str, float]], units: dict[str, str]
) -> tuple[list[str], list[tuple[str, str, list[str]]]]:
    """The joints, and of each effect the unit and the smallest size that would have shown there."""
    joints = sorted({j for by in sizes.values() for j in by}, key=int)
    rows = []
    for name, by in sizes.items():
        factor, unit = _scaled(median(by.values()), units.get(name, ""))
        found = [f"{factor * by[j]:.2g}" if j in by else "–" for j in joints]
        rows.append((name, unit, found))
    return joints, rows


def with_unit(size: float, unit: str) -> str:
    """A size to two digits with its unit."""
    factor, said = _scaled(size, unit)
    return f"{factor * size:.2g} {said}".replace("-", "−").rstrip()


def _scaled(size: float, unit: str) -> tuple[float, str]:
    """By what a size is multiplied to read well, and its unit then."""
    if unit == "1":
        return 100.0, "%"
    text = unit.replace("^2", "²").replace("^3", "³").replace(" ", "\u202f")
    if abs(size) >= _SMALL or not unit.startswith(("N", "rad", "s", "kg")):
        return 1.0, text
    return 1e3, text[1:] if text.startswith("kg") else f"m{text}"


def _measured(value: dict[str, Any]) -> str:
    """A value with its standard deviation to two digits, and its unit."""
    factor, unit = _scaled(value["value"], value["unit"])
    size, sd = factor * value["value"], factor * value["sd"]
    places = max(0, 1 - floor(log10(sd))) if sd else 4
    return f"{size:.{places}f} ± {sd:.{places}f} {unit}".replace("-", "−").rstrip()


@cache
def _template() -> Template:
    loader = PackageLoader("wamctl.investigation", ".")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["odds"] = odds_text
    environment.filters["words"] = words
    environment.filters["measured"] = _measured
    return environment.get_template("page.html.j2")
