"""A page: verdict first, then sections of sentences, figures, and tables; one file, no network."""

import json
import re
import shlex
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any, ClassVar, Literal, TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from ident.report.charts import Chart
from ident.report.words import DASH

Item = TypeVar("Item")
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


_NUMBER = re.compile(r"[−+]?\d[\d\u202f.]*(·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?($|\u202f| ±)")


@dataclass(frozen=True)
class Table:
    """Rows of printed cells; the first cell of each is its head.

    Attributes:
        caption: what it holds.
        heads: of the columns.
        rows: cells in print.
        strong: places of rows that matter most.
        pale: places of rows that matter least.
        sortable: whether a reader sorts it by its columns, and filters its rows.
    """

    kind: ClassVar[str] = "table"
    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    strong: Collection[int] = ()
    pale: Collection[int] = ()
    sortable: bool = False

    @property
    def kinds(self) -> list[Literal["words", "numbers"]]:
        """What each column holds: after the first, numbers where every cell is one or a dash."""
        columns = [[row[k] for row in self.rows] for k in range(1, len(self.heads))]
        numbers = [all(c in ("", DASH) or _NUMBER.match(c) for c in cells) for cells in columns]
        return ["words", *("numbers" if n else "words" for n in numbers)]


def table_of(
    caption: str, items: Iterable[Item], cells: Mapping[str, Callable[[Item], str]], **marks: Any
) -> Table:
    """A row for each item; `cells` says of each column by its head what stands there."""
    rows = [[cell(item) for cell in cells.values()] for item in items]
    return Table(caption, list(cells), rows, **marks)


@dataclass(frozen=True)
class Figure:
    """Charts of one kind with one caption, and the same in numbers, folded away.

    Attributes:
        title: headline.
        caption: what the charts show and how to read them.
        charts: small ones stand side by side.
        table: the numbers behind them.
    """

    kind: ClassVar[str] = "figure"
    title: str
    caption: str
    charts: Sequence[Chart]
    table: Table

    @property
    def joints(self) -> bool:
        """Whether there are joints to choose from."""
        return len({c.joint for c in self.charts if c.joint}) > 1


@dataclass(frozen=True)
class Beside:
    """Small tables that share the width of the page."""

    kind: ClassVar[str] = "beside"
    tables: Sequence[Table]


Block = Text | Points | Figure | Table | Beside


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it, perhaps folded away."""

    heading: str
    blocks: Sequence[Block]
    folded: bool = False

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
class Step:
    """Something to do next: why, and the words of the command; none where it is no command."""

    why: str
    words: Sequence[str] = ()

    @property
    def command(self) -> str:
        """As a shell takes it."""
        return shlex.join(self.words)


@dataclass(frozen=True)
class Page:
    """All that a report says.

    Attributes:
        command: that wrote it.
        title: headline.
        verdict: the answer.
        figures: number, its name; a few that sum up the rest.
        sections: in the order of reading.
        steps: what to do next.
    """

    command: str
    title: str
    verdict: Verdict
    figures: Sequence[tuple[str, str]]
    sections: Sequence[Section]
    steps: Sequence[Step] = ()


def commands_as_code(sentence: str) -> Markup:
    """A sentence with what stands between backticks set as code; all of it escaped."""
    parts = str(sentence).split("`")
    if len(parts) % 2 == 0 or len(parts) == 1:
        return escape(sentence)
    return Markup().join(
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part)
        for k, part in enumerate(parts)
    )


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("ident.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["code"] = commands_as_code
    return environment


@cache
def asset(name: str) -> Markup:
    """A file of `assets`, as it stands."""
    return Markup(files("ident.report").joinpath("assets", name).read_text(encoding="utf-8"))


def render(page: Page) -> str:
    """The page as HTML."""
    charts: list[Chart] = []

    def place(chart: Chart) -> int:
        charts.append(chart)
        return len(charts) - 1

    def data() -> Markup:
        text = json.dumps([c.spec for c in charts], separators=(",", ":"), allow_nan=False)
        return Markup(text.replace("<", "\\u003c"))

    template = _environment().get_template("page.html")
    return template.render(page=page, place=place, data=data, asset=asset)


def with_trust(verdict: Verdict, content: Mapping[str, Any], field: str = "verdict") -> Verdict:
    """A page's verdict behind what the checks of the recordings found.

    Args:
        verdict: what the result says.
        content: of the result file.
        field: that holds `trustworthy` or `doubtful`; without it the verdict stays as it is.
    """
    if field not in content:
        return verdict
    sentences = [r["sentence"] for r in content["remarks"]]
    if content[field] == "trustworthy":
        return replace(verdict, more=[*verdict.more, *sentences])
    return Verdict("warning", content[field], sentences[0], [
        *sentences[1:], verdict.sentence, *verdict.more,
    ])  # fmt: skip
