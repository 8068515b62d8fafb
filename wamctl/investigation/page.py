"""The notebook of an investigation: one self-contained page, written after every round."""

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from wamctl.investigation.evidence import odds_text

_BAR = 7  # px, of one block's outcome
_HALF = 24  # px, of the largest outcome


def page(content: dict[str, Any], sentence: str) -> str:
    """The page of an `investigation.json`.

    Args:
        content: its content.
        sentence: the verdict in a sentence.
    """
    rounds = [
        r | {"likely": _likely(r["odds"]), "drawn": _drawn(r["bets"])} for r in content["rounds"]
    ]
    used = content["budget"]["used"] | {
        "wall_s": content["wall_s"],
        "motions": max(0, len([r for r in rounds if not r["changed"]]) - 1),
        "answers": len([r for r in rounds if r["changed"]]),
    }
    declared = content["budget"]["declared"]
    budget = [(name, used[name], most) for name, most in declared.items()]
    return _template().render(content=content, sentence=sentence, rounds=rounds, budget=budget)


def _likely(odds: dict[str, float]) -> list[tuple[str, float]]:
    return sorted(odds.items(), key=lambda item: -item[1])


def _drawn(bets: dict[str, list[float]]) -> dict[str, list[dict[str, float]]]:
    """Bars of each block's outcome: up where the leader predicted better."""
    return {
        rival: [
            {"x": k * _BAR, "y": _HALF - max(b, 0.0) * _HALF, "height": max(abs(b) * _HALF, 0.5)}
            for k, b in enumerate(won)
        ]
        for rival, won in bets.items()
    }


@cache
def _template() -> Template:
    loader = PackageLoader("wamctl.investigation", ".")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["odds"] = odds_text
    return environment.get_template("page.html.j2")
