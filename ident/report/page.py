"""A page: verdict first, then sections of sentences, figures, and tables; one file, no network."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count
from typing import ClassVar, Literal

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from ident.report.style import Sign
from ident.report.svg import Drawing

Status = Literal["good", "warning", "bad", "open"]


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str


@dataclass(frozen=True)
class Points:
    """Sentences that stand beside each other."""

    kind: ClassVar[str] = "points"
    items: Sequence[str]


@dataclass(frozen=True)
class Gallery:
    """Figures of one kind with one caption; small ones stand side by side.

    Attributes:
        drawings: the figures.
        caption: what they show and how to read them.
        signs: words and signs that all of them share.
    """

    kind: ClassVar[str] = "gallery"
    drawings: Sequence[Drawing]
    caption: str
    signs: Sequence[tuple[str, Sign]] = ()


@dataclass(frozen=True)
class Column:
    """Head of a table's column; `of` says whether it holds words or numbers."""

    head: str
    of: Literal["words", "numbers"] = "numbers"


@dataclass(frozen=True)
class Table:
    """Rows of printed cells; the first cell of each is its head.

    Attributes:
        caption: what it holds.
        columns: heads.
        rows: cells in print.
        strong: places of rows that matter most.
        pale: places of rows that matter least.
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    strong: frozenset[int] = frozenset()
    pale: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Beside:
    """Small tables that share the width of the page."""

    kind: ClassVar[str] = "beside"
    tables: Sequence[Table]


Block = Text | Points | Gallery | Table | Beside


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it."""

    heading: str
    blocks: Sequence[Block]

    @property
    def anchor(self) -> str:
        """Name that the contents list links to."""
        return "".join(c if c.isalnum() else "-" for c in self.heading.lower())


@dataclass(frozen=True)
class Verdict:
    """What a reader should take away, if nothing else.

    Attributes:
        status: good, warning, bad, or open.
        word: the status in a word or two.
        sentence: the answer with its numbers and their uncertainty.
        more: what to know beside it.
    """

    status: Status
    word: str
    sentence: str
    more: Sequence[str] = ()


@dataclass(frozen=True)
class Page:
    """All that a report says.

    Attributes:
        command: that wrote it.
        title: headline.
        verdict: the answer.
        figures: number, its name; a few that sum up the rest.
        sections: in the order of reading.
    """

    command: str
    title: str
    verdict: Verdict
    figures: Sequence[tuple[str, str]]
    sections: Sequence[Section]


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("ident.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(page: Page) -> str:
    """The page as HTML."""
    names = count(1)

    def svg(drawing: Drawing) -> Markup:
        return Markup(drawing.svg(f"drawing-{next(names)}"))

    return _environment().get_template("page.html").render(page=page, svg=svg)
