"""What the page of a gap is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ident.report.page import Block, Figure
from ident.report.words import known
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joint_labels, joints_text

Content = Mapping[str, Any]


@dataclass(frozen=True)
class GapReport:
    """What the page is made of.

    Attributes:
        content: of `gap.json`.
        arm: its name.
        joints: names.
        titles: of the effects in plain words, by id.
        explained: of each effect by id: its signature, and the motion that tells it from others.
        sizes: of each effect by id: the coefficient that is its size, and its unit.
        curves: of the first effects of the content: a figure of each.
        turning: rms residual while a joint turns round, without and with the effects [N m],
            shape (2, n); None where unknown.
        left: figures of what is left where it has no name.
        torque: figures of torque over time.
        motion: figures of measured and simulated motion.
        acts: where each effect acts most, in its own variable, a sentence each.
    """

    content: Content
    arm: str
    joints: Sequence[str]
    titles: Mapping[str, str]
    explained: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    sizes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    curves: Sequence[Figure] = ()
    turning: Array | None = None
    left: Sequence[Block] = ()
    torque: Sequence[Block] = ()
    motion: Sequence[Block] = ()
    acts: Sequence[str] = ()

    @property
    def labels(self) -> list[str]:
        """The joints in print."""
        return joint_labels(self.joints)

    @property
    def moving(self) -> list[int]:
        """The joints, from 0, that the residual tells of: all but those that were held."""
        rms = self.content["held_out"].get("before", {}).get("rms_by_joint") or []
        return [j for j, value in enumerate(rms) if known(value)] or list(range(len(self.joints)))

    @property
    def named(self) -> bool:
        """Whether there is a model with effects beside the one without."""
        return bool(self.content["effects"]) and self.content["verdict"] != "data_fault"

    def title(self, effect: str) -> str:
        """An effect in plain words."""
        return self.titles.get(effect, effect.replace("_", " "))

    def of(self, joints: Sequence[int]) -> str:
        """Joints, from 1, in a sentence."""
        if not joints:
            return "the whole arm"
        return joints_text([self.labels[j - 1] for j in joints])
