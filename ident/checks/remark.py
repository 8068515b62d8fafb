"""What a check has to say, and the verdict that follows from all remarks."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from wamctl.arm.errors import DataError
from wamctl.arm.joint_labels import joint_labels, joints_text

_LACKING = ("large_error", "impossible_torque")  # of models that lack something, not on their input


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
        finding: what was found, a sentence.
        grade: what it does to the verdict.
        advice: what to do about it, a sentence; nothing that lowers the verdict is without it.
    """

    code: str
    joints: tuple[int, ...]
    finding: str
    grade: Grade
    advice: str = ""

    def __post_init__(self) -> None:
        """See that a remark that lowers the verdict says what to do."""
        if self.grade is not Grade.TRUSTWORTHY and not self.advice:
            raise ValueError(f"a remark without advice: {self.finding}")

    @property
    def sentence(self) -> str:
        """Finding and advice in print."""
        return f"{self.finding} {self.advice}".rstrip()

    def content(self) -> dict[str, Any]:
        """As it stands in result files."""
        return {
            "code": self.code,
            "joints": list(self.joints),
            "sentence": self.sentence,
            "advice": self.advice,
        }


def no_fit(finding: str, grade: Grade = Grade.REFUSED) -> Remark:
    """A fit that found no solution, or a doubtful one."""
    advice = (
        "Check that the URDF, joints and torque belong together, and that every joint moves far and"
        " fast enough."
    )
    return Remark("no_fit", (), finding, grade, advice)


def undetermined() -> Remark:
    """Recordings that leave parameters of the model free."""
    return Remark(
        "poor_motion",
        (),
        "These recordings leave parameters of the model undetermined.",
        Grade.REFUSED,
        "Move every joint farther and faster; `ident design` computes a suitable motion.",
    )


def verdict_of(remarks: Iterable[Remark]) -> Grade:
    """The worst grade of all remarks."""
    return max((r.grade for r in remarks), default=Grade.TRUSTWORTHY)


class RefusedError(DataError):
    """Recordings, or an arm, from which no result may be drawn.

    Attributes:
        remarks: the reasons, and what else was found.
    """

    def __init__(self, remarks: Sequence[Remark]) -> None:
        self.remarks = tuple(remarks)
        super().__init__(self.remarks)

    def __str__(self) -> str:
        return "\n".join(verdict_lines(self.remarks))


def gravest_first(remarks: Iterable[Remark]) -> list[Remark]:
    """The remarks in the order in which they should be read."""
    return sorted(remarks, key=lambda r: -r.grade)


def verdict_lines(remarks: Iterable[Remark]) -> list[str]:
    """The verdict in print."""
    ordered = gravest_first(remarks)
    return verdict_said(verdict_of(ordered).word, [r.sentence for r in ordered])


def verdict_said(word: str, sentences: Sequence[str], of: str = "this result") -> list[str]:
    """A verdict in print: its word with the gravest remark, then the others; and what it is of."""
    if word == Grade.TRUSTWORTHY.word:
        return [f"Trustworthy: the checks found nothing that speaks against {of}.", *sentences]
    return [f"{word.capitalize()}: {sentences[0]}", *sentences[1:]]


def speaks_against_input(remarks: Iterable[Mapping[str, Any]]) -> bool:
    """Whether a remark of a result file advises more than to look for what the model lacks."""
    return any(r.get("advice") and r["code"] not in _LACKING for r in remarks)


def verdict_content(remarks: Iterable[Remark]) -> dict[str, Any]:
    """`verdict` and `remarks` of a result file, the gravest remark first."""
    ordered = gravest_first(remarks)
    return {"verdict": verdict_of(ordered).word, "remarks": [r.content() for r in ordered]}


def joined(words: Sequence[str]) -> str:
    """Words as a list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def joints(places: Iterable[int], names: Sequence[str]) -> str:
    """Joints by number and short name; places count from 0."""
    labels = joint_labels(names)
    return joints_text([labels[k] for k in places])


def numbers(places: Iterable[int]) -> tuple[int, ...]:
    """Joints as remarks hold them, from 1."""
    return tuple(int(k) + 1 for k in places)
