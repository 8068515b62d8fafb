"""The numbers that decide what a search by simulation finds."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class SearchSettings:
    """Every number that decides what is found.

    Attributes:
        null_runs: effect-free simulations behind the thresholds.
        least_gain: nats per sample that any effect has to bring where it was not fitted; 0.03 is
            3 %.
        null_factor: by how much it has to exceed the largest gain of the effect-free simulations.
        per_quantity: nats per sample that each further quantity of an effect has to earn.
        sure: standard errors over blocks of time by which it has to help.
        sure_size: standard deviations by which its size has to be from nothing.
        seen: of the encoder's own noise (a step over the root of 12), what it explains at least.
        apart: standard errors by which an effect has to beat a rival, and by which no recording
            may speak against it.
        rival_share: of its gain, what a rival has at least.
        together: of the largest gain, what joints need that are given their effect in one round.
        clear: of the noise floor, above which something is left; every effect is tried there,
            whatever it promises in first order.
        clear_steps: of the encoder, rms, that it has to be beyond the floor.
        unclosed: share of a joint's gap that may be left beside named effects.
        screen_share: of what the best part explains at a joint in first order, what another has to
            explain to be fitted.
        alike_forms: of twice the log-likelihood, odds of seven to one, within which forms of an
            effect fit alike: the middle one is told.
        near_forms: nats per sample, a residual twice as large: the interval holds forms within it,
            since the true one need be none of them.
        rounds: of the search.
        fit_rounds: steps of a fit with a trial effect.
    """

    null_runs: int = 4
    least_gain: float = 0.03
    null_factor: float = 2.0
    per_quantity: float = 0.01
    sure: float = 4.0
    sure_size: float = 3.0
    seen: float = 0.5
    apart: float = 2.0
    rival_share: float = 0.5
    together: float = 0.5
    clear: float = 1.6
    clear_steps: float = 1.0
    unclosed: float = 0.5
    screen_share: float = 0.25
    alike_forms: float = 4.0
    near_forms: float = 0.7
    rounds: int = 4
    fit_rounds: int = 12

    def content(self) -> dict[str, Any]:
        """As it stands in `gap.json`."""
        return asdict(self)
