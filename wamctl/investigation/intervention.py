"""What the operator is asked to do to the arm where no motion alone settles it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from wamctl.arm.configuration.known_change import WORDS, KnownChange, known_change
from wamctl.arm.configuration.yaml_file import shipped_file
from wamctl.investigation.budget import Budget
from wamctl.investigation.decision import Decision
from wamctl.investigation.state import AMBIGUOUS, Request, State, made

_EMBEDDED = "sim"


def question(state: State, budget: Budget, decision: Decision, asked: str | None) -> str:
    """What to ask the operator; empty where nothing is to be asked.

    Args:
        state: so far.
        budget: only its motions may be used up.
        decision: the end that is near.
        asked: what the last plan says would settle it.
    """
    if decision.verdict != AMBIGUOUS or not asked or state.answers >= budget.answers:
        return ""
    if not state.asked_for_gap or budget.passed(state.cost, state.wall_s, 0):
        return ""
    return f"{decision.sentence} What would settle it: {asked}. What has been done? Say {WORDS}."


def with_change(request: Request, change: str, folder: Path) -> Request:
    """What to run; the embedded simulated arm gets the change done to it, in a file of the folder.

    Args:
        request: of the investigation.
        change: the operator's answer; empty for none.
        folder: of the round.
    """
    if not change or request.bus != _EMBEDDED or not known_change(change).alters_the_model:
        return request
    effects = _hidden(request.hidden) + _as_effects(known_change(change))
    text = yaml.safe_dump({"summary": "as the operator said", "effects": effects})
    path = made(folder / "hidden.yaml", lambda p: _write(p, text))
    return replace(request, hidden=str(path))


def _hidden(name: str | None) -> list[dict[str, Any]]:
    if name is None:
        return []
    path = Path(name)
    if not path.is_file():
        path = shipped_file(f"hidden/{name}.yaml")
    return yaml.safe_load(path.read_text(encoding="utf-8"))["effects"]


def _as_effects(change: KnownChange) -> list[dict[str, Any]]:
    mass, *centre = change.load
    x, y = change.tilt_rad
    load = {"effect": "payload", "kg": mass, "at_m": centre, "radius_m": 0.0}
    tilt = {"effect": "gravity_tilt", "x_rad": x, "y_rad": y}
    return [load] * (mass > 0.0) + [tilt] * (x != 0.0 or y != 0.0)


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
