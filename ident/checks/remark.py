"""What a check has to say, and the verdict that follows from all remarks."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any


class Grade(IntEnum):
    """How far a remark lowers the trust in a result; the verdict is the worst one."""

    TRUSTWORTHY = 0
    DOUBTFUL = 1
    REFUSED = 2

    @property
    def word(self) -> str:
        """As it stands in result files."""
        return self.name.lower()


@dataclass(frozen=True)
class Remark:
    """One finding.

    Attributes:
        code: of the kind of finding, e.g. `units`.
        joints: joints that it is about, from 1; empty: all of them.
        sentence: what it looks like, and what to do.
        grade: what it does to the verdict.
    """

    code: str
    joints: tuple[int, ...]
    sentence: str
    grade: Grade

    def content(self) -> dict[str, Any]:
        """As it stands in result files."""
        return {"code": self.code, "joints": list(self.joints), "sentence": self.sentence}


def verdict_of(remarks: Iterable[Remark]) -> Grade:
    """The worst grade of all remarks."""
    return max((r.grade for r in remarks), default=Grade.TRUSTWORTHY)


def verdict_content(remarks: Iterable[Remark]) -> dict[str, Any]:
    """`verdict` and `remarks` of a result file, the gravest remark first."""
    ordered = sorted(remarks, key=lambda r: -r.grade)
    return {"verdict": verdict_of(ordered).word, "remarks": [r.content() for r in ordered]}
