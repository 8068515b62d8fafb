"""Gain that each effect must reach, and how effect-free runs raise it."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.effects.catalogue import catalogue
from ident.effects.events import CONTACT
from ident.gap.settings import Thresholds


@dataclass(frozen=True)
class Threshold:
    """Gains from which something is believed.

    Attributes:
        gain: [nats per sample], by id of effect or event.
        structure: gain from which structure without a name counts [nats per sample].
        draws: number of effect-free runs behind it.
    """

    gain: dict[str, float]
    structure: float
    draws: int

    @property
    def least(self) -> float:
        """The smallest gain that any effect must reach."""
        return min(self.gain.values())

    def of(self, effect: str) -> float:
        """The gain that an effect or event must reach."""
        return self.gain[effect]

    def raised(
        self, gains: Sequence[dict[str, float]], structure: Sequence[float], factor: float
    ) -> "Threshold":
        """The threshold with more effect-free runs behind it; it never falls.

        Args:
            gains: largest gain of each effect in each run.
            structure: largest gain of structure without a name in each run.
            factor: multiple of the largest gain that is asked for.
        """
        gain = dict(self.gain)
        for run_gains in gains:
            for effect, value in run_gains.items():
                gain[effect] = max(gain[effect], factor * value)
        most = max([self.structure, *(factor * x for x in structure)])
        return Threshold(gain, most, self.draws + len(gains))


def least_threshold(settings: Thresholds, beside_reference: bool = False) -> Threshold:
    """The threshold before anything is simulated.

    Args:
        settings: of the thresholds.
        beside_reference: changes against a reference model are searched.
    """
    least = settings.min_gain_beside_reference if beside_reference else settings.min_gain
    gain = dict.fromkeys(catalogue(), least) | {CONTACT.id: settings.min_transient_gain}
    return Threshold(gain, settings.safety_factor * least, 0)
