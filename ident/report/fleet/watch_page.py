"""The page of `ident watch`: whether the trusted model explains the arm, and what does not fit."""

from collections.abc import Sequence

from ident.report.page import Page, Section, Text, Verdict, table_of
from ident.report.words import Content, number, plus_minus, whole

_LN_10 = 2.302585
_SURE = 2.0  # standard errors: smaller numbers are not shown


def watch_page(source: str, lines: Sequence[Content]) -> Page:
    """The page of what was told so far.

    Args:
        source: what is watched.
        lines: alarms, and the end where it has come.
    """
    alarms = [line for line in lines if line["kind"] != "end"]
    motion = [line["motion_s"] for line in lines if line["kind"] == "end"]
    figures = [(whole(len(alarms)), "alarms")]
    figures += [(number(s / 60.0), "minutes of motion") for s in motion]
    return Page("ident watch", source, _verdict(alarms), figures, [_told(alarms)])


def _verdict(alarms: Sequence[Content]) -> Verdict:
    if not alarms:
        return Verdict("good", "no alarm", "The trusted model explains all that the arm did.")
    first = alarms[0]
    where = "".join(f" at joint {j}" for j in first["joints"])
    sentence = f"Since {first['since']} the trusted model no longer explains the arm: "
    word = f"{len(alarms)} alarm{'s' * (len(alarms) > 1)}"
    return Verdict("warning", word, sentence + first["kind"] + where + ".")


def _told(alarms: Sequence[Content]) -> Section:
    table = table_of(
        "Alarms (± standard error).",
        alarms,
        {
            "since": lambda a: a["since"],
            "told": lambda a: a["told"],
            "what": lambda a: a["kind"] + "".join(f", joint {j}" for j in a["joints"]),
            "sizes": lambda a: "; ".join(_sizes(a)),
            "or": lambda a: a["rival"],
            "odds against no change, powers of ten": lambda a: number(a["evidence"] / _LN_10),
        },
        sortable=True,
    )
    return Section("Alarms", [table if alarms else Text("Nothing was told.")])


def _sizes(alarm: Content) -> list[str]:
    sure = {
        name: p
        for name, p in alarm["parameters"].items()
        if abs(p["value"]) > _SURE * p["sd"] or name == "mass"
    }
    return [f"{name} {plus_minus(p['value'], p['sd'], p['unit'])}" for name, p in sure.items()]
