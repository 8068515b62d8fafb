"""What a search found, and the effects that it named, as Python sees them."""

from dataclasses import dataclass
from typing import Any, TypeVar

from ident.api.result import Result, html_table
from ident.workflows.work import Search

SearchT = TypeVar("SearchT", bound=Search)


@dataclass(frozen=True)
class Effect:
    """An effect that was named.

    Attributes:
        name: its id, such as `stribeck`.
        joints: names of its joints.
        parameters: value, standard error and unit of each, by name.
        equation: the torque that it adds.
        rivals: effects that cannot be told from it, with their joints from 1.
    """

    name: str
    joints: tuple[str, ...]
    parameters: dict[str, dict[str, Any]]
    equation: str
    rivals: tuple[dict[str, Any], ...]


class NamedEffects(Result[SearchT]):
    """The result of a search; `save` writes `gap.json`, `model.yaml` and `report.html`.

    The verdict is `no_gap`, `named`, `ambiguous`, `unknown` or `data_fault`.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def sentences(self) -> list[str]:
        """The verdict in sentences."""
        return self.run.sentences

    @property
    def summary(self) -> str:
        """The verdict in sentences."""
        return " ".join(self.sentences)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were named, in the order in which they were found."""
        names = self.content["joints"]
        return tuple(
            Effect(
                e["name"],
                tuple(names[j - 1] for j in e["joints"]),
                e["parameters"],
                e["equation"],
                tuple(e["rivals"]),
            )
            for e in self.content["effects"]
        )

    def _repr_html_(self) -> str:
        rows = [
            {
                "effect": e.name,
                "joints": ", ".join(e.joints),
                "parameter": name,
                "value": p["value"],
                "sd": p["sd"],
                "unit": p["unit"],
            }
            for e in self.effects
            for name, p in e.parameters.items()
        ]
        return html_table(self.summary, rows)
