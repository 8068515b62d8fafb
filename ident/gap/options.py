"""How one search is done."""

from dataclasses import dataclass, field
from typing import Any

from ident.gap.settings import GapSettings


@dataclass(frozen=True)
class Options:
    """How one search is done.

    Attributes:
        null_runs: number of effect-free simulations behind the thresholds.
        cutoff_hz: cut-off of the windows [Hz]; lower where the sampling rate is low.
        seed: of everything that is drawn at random.
        with_suspected: whether effects that are only suspected stay in the model.
        terms_on_demand: whether offsets and rotors that predict better are in the model, named or
            not.
        settings: numbers that decide the verdict.
    """

    null_runs: int = 4
    cutoff_hz: float = 10.0
    seed: int = 0
    with_suspected: bool = False
    terms_on_demand: bool = True
    settings: GapSettings = field(default_factory=GapSettings)

    def content(self) -> dict[str, Any]:
        """What `gap.json` says about the search."""
        numbers = {"null_runs": self.null_runs, "cutoff_hz": self.cutoff_hz, "seed": self.seed}
        return numbers | self.settings.model_dump()
