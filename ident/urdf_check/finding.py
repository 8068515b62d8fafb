"""What is wrong with a link or a joint of a URDF."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

Repair = Callable[[], None]


class Grade(StrEnum):
    """How bad it is."""

    FAULT = "fault"
    DOUBT = "doubt"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth knowing.

    Attributes:
        grade: a fault cannot be or cannot be used; a doubt can be, but is hardly meant.
        code: kind of the finding, such as `triangle`.
        kind: `link`, `joint` or `robot`.
        name: of the link or joint.
        sentence: what is wrong, and what to do.
        repair: changes the XML tree that was examined; None where only a measurement helps.
        repaired_to: what the repair writes, in words.
    """

    grade: Grade
    code: str
    kind: str
    name: str
    sentence: str
    repair: Repair | None = None
    repaired_to: str = ""

    def content(self) -> dict[str, Any]:
        """As it stands in JSON."""
        return {
            "grade": self.grade.value,
            "code": self.code,
            "kind": self.kind,
            "name": self.name,
            "sentence": self.sentence,
            "repair": self.repaired_to or None,
        }
