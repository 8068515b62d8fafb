"""The notebook of an investigation: one self-contained page, written after every round."""

import math
from functools import cache
from math import floor, log10
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from wamctl.investigation.evidence import odds_text, words

_BAR = 7  # px, of one block's outcome
_HALF = 24  # px, of the largest outcome
_WIDE, _HIGH = 420.0, 130.0  # px, of a measured curve
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


def page(content: dict[str, Any], sentence: str, advice: str) -> str:
    """The page of an `investigation.json`.

    Args:
        content: its content.
        sentence: the verdict in a sentence.
        advice: the command that comes next.
    """
    rounds = [
        r | {"likely": _likely(r["odds"]), "drawn": _drawn(r["bets"])} for r in content["rounds"]
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
    """A measured curve as points [px], with its band of two standard deviations."""
    known = list(effect["parameters"].values())
    size, band = [v["value"] for v in known], [2.0 * v["sd"] for v in known]
    low = min(0.0, *(y - b for y, b in zip(size, band, strict=True)))
    high = max(0.0, *(y + b for y, b in zip(size, band, strict=True)))
    across, up = _WIDE / max(len(size) - 1, 1), _HIGH / max(high - low, _LEAST)

    def path(values: list[float]) -> list[str]:
        return [f"{k * across:.1f},{(high - y) * up:.1f}" for k, y in enumerate(values)]

    above = path([y + b for y, b in zip(size, band, strict=True)])
    below = path([y - b for y, b in zip(size, band, strict=True)])
    joined = {"line": " ".join(path(size)), "band": " ".join([*above, *reversed(below)])}
    return joined | {"zero": high * up, "low": low, "high": high, "unit": known[0]["unit"]}


def _measured(value: dict[str, Any]) -> str:
    """A value with its standard deviation to two digits, and its unit."""
    places = max(0, 1 - floor(log10(value["sd"]))) if value["sd"] else 4
    unit = "" if value["unit"] == "1" else f" {value['unit']}"
    return f"{value['value']:.{places}f} ± {value['sd']:.{places}f}{unit}".replace("-", "−")


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
