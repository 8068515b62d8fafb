"""What the pages of a search are made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from ident.effects.catalogue import catalogue
from ident.effects.events import EVENTS
from ident.report.page import Block, Figure
from ident.report.words import Content, known
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joint_labels, joints_text


@dataclass(frozen=True)
class SearchReport:
    """What the page of a search is made of, by torque or by simulation.

    Attributes:
        content: of `gap.json`.
    """

    unlisted: ClassVar[str] = "{}"
    """What to call an effect that the catalogue does not have."""

    content: Content

    @property
    def labels(self) -> list[str]:
        """The joints in print."""
        return joint_labels(self.content["joints"])

    def title(self, effect: str) -> str:
        """An effect in plain words."""
        known_as = _effects().get(effect)
        return known_as.title if known_as else self.unlisted.format(effect.replace("_", " "))

    def of(self, joints: Sequence[int]) -> str:
        """Joints, from 1, in a sentence."""
        if not joints:
            return "the whole arm"
        if len(joints) == len(self.labels) > 2:
            return "all joints"
        return joints_text([self.labels[j - 1] for j in joints])

    def signature(self, effect: str) -> str:
        """How an effect shows; nothing where the catalogue does not say."""
        return _effects()[effect].signature if effect in _effects() else ""

    def experiment(self, effect: str) -> str:
        """The motion that tells an effect from others; nothing where the catalogue has none."""
        return _effects()[effect].experiment if effect in _effects() else ""


def _effects() -> dict[str, Any]:
    return catalogue() | EVENTS


@dataclass(frozen=True)
class GapReport(SearchReport):
    """What the page of a search by torque is made of, beside the content of `gap.json`.

    Attributes:
        sizes: of each effect by id: the coefficient that is its size, and its unit.
        curves: of the first effects of the content: a figure of each.
        turning: rms residual while a joint turns round, without and with the effects [N m],
            shape (2, n); None where unknown.
        left: figures of what is left where it has no name.
        torque: figures of torque over time.
        motion: figures of measured and simulated motion.
        acts: where each effect acts most, in its own variable, a sentence each.
    """

    sizes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    curves: Sequence[Figure] = ()
    turning: Array | None = None
    left: Sequence[Block] = ()
    torque: Sequence[Block] = ()
    motion: Sequence[Block] = ()
    acts: Sequence[str] = ()

    @property
    def moving(self) -> list[int]:
        """The joints, from 0, that the residual tells of: all but those that were held."""
        rms = self.content["held_out"].get("before", {}).get("rms_by_joint") or []
        return [j for j, x in enumerate(rms) if known(x)] or list(range(len(self.labels)))

    @property
    def named(self) -> bool:
        """Whether there is a model with effects beside the one without."""
        return bool(self.content["effects"]) and self.content["verdict"] != "data_fault"
