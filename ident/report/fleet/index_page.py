"""`fleet.html`: which arms have changed, how sure that is, since when, and all arms in a table."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from urllib.parse import quote

from markupsafe import Markup

from ident.report.fleet.words import change_text, day, rivals_text, what_text
from ident.report.page import Block, Page, Points, Section, Step, Table, Text, Verdict, table_of
from ident.report.words import DASH, Content, number, plus_minus, setting, unit_text, whole
from wamctl.arm.joint_labels import joint_labels, listed

_LN_10 = 2.302585


def index_page(content: Content, pages: Mapping[str, str]) -> Page:
    """The page of a fleet.

    Args:
        content: of `fleet.json`.
        pages: address of each arm's own page, for those that have one.
    """
    logs = content["logs"]
    arms = {a["arm"] for a in content["arms"]}
    by_arm: dict[str, list[Content]] = defaultdict(list)
    for change in content["changes"]:
        by_arm[change["arm"]].append(change)
    sections = [
        Section("What has changed", [*_changes(content, pages), *_unseen(content)]),
        Section("All arms", [_arms(content, by_arm, pages)]),
        Section("How small a change would be told", _shown(content), folded=True),
        Section("What arms of a type share", _types(content), folded=True),
        Section("Logs that could not be used", _refused(content), folded=True),
        Section("How this was decided", _method(content), folded=True),
    ]
    figures = [
        (whole(len(arms)), "arms"),
        (whole(logs["used"]), "logs"),
        (whole(logs["refused"]), "logs that could not be used"),
        (whole(len(by_arm)), "arms that have changed"),
    ]
    return Page(
        "ident fleet", "The fleet", _verdict(content, by_arm), figures, sections, _steps(content)
    )


def _verdict(content: Content, by_arm: Mapping[str, Sequence[Content]]) -> Verdict:
    share = content["settings"]["false_alarm_share"]
    count = len({a["arm"] for a in content["arms"]})
    if not by_arm:
        sentence = (
            f"None of {count} arms has changed beyond what days, temperature and chance explain."
        )
        return Verdict("good", "no change", sentence)
    first = sorted(by_arm.items(), key=lambda item: -item[1][0]["evidence"])[:5]
    labels = _labels(content)
    said = [
        f"{arm}: {change_text(c[0], labels[c[0]['arm']])}, since {day(c[0]['since'])}."
        for arm, c in first
    ]
    more = len(by_arm) - len(first)
    said += [f"And {more} more."] if more else []
    arms, have = "arm" if count == 1 else "arms", "has" if len(by_arm) == 1 else "have"
    return Verdict(
        "warning",
        f"{len(by_arm)} changed",
        f"{len(by_arm)} of {count} {arms} {have} changed; of all arms called changed, no more than"
        f" {setting(100 * share)}\u202f% are to be expected to be false alarms.",
        said,
    )


def _labels(content: Content) -> dict[str, list[str]]:
    """Labels of each arm's joints."""
    return {a["arm"]: joint_labels(content["types"][a["type"]]["joints"]) for a in content["arms"]}


def _link(arm: str, pages: Mapping[str, str]) -> str:
    if arm not in pages:
        return arm
    return Markup('<a href="{}">{}</a>').format(quote(pages[arm]), arm)


def _changes(content: Content, pages: Mapping[str, str]) -> list[Block]:
    if not content["changes"]:
        return [Text("No change was found.")]
    labels = _labels(content)
    table = table_of(
        "Changes (± standard error).",
        sorted(content["changes"], key=lambda c: -c["evidence"]),
        {
            "arm": lambda c: _link(c["arm"], pages),
            "since": lambda c: day(c["since"]),
            "what": lambda c: what_text(c, labels[c["arm"]]) + "." + rivals_text(c),
            "size": lambda c: f"{c['parameter']}: {plus_minus(c['size'], c['sd'], c['unit'])}",
            "odds against no change, powers of ten": lambda c: number(c["evidence"] / _LN_10),
            "told on": lambda c: day(c["told"]),
            "onset's share of the odds": lambda c: number(c["onset_share"], 2),
        },
        sortable=True,
    )
    return [table]


def _arms(
    content: Content, by_arm: Mapping[str, Sequence[Content]], pages: Mapping[str, str]
) -> Table:
    def odds(arm: Content) -> str:
        return DASH if arm["log_odds"] is None else number(arm["log_odds"] / _LN_10, 2)

    return table_of(
        "All arms.",
        content["arms"],
        {
            "arm": lambda a: _link(a["arm"], pages),
            "changed since": lambda a: (
                day(by_arm[a["arm"]][0]["since"]) if a["arm"] in by_arm else DASH
            ),
            "odds of a change now, powers of ten": odds,
            "logs": lambda a: whole(a["logs"]),
            "first": lambda a: day(a["first"]),
            "last": lambda a: day(a["last"]),
            "farthest from its sisters": lambda a: a["farthest"]["parameter"],
            "by [sd]": lambda a: number(a["farthest"]["sds"], 2),
        },
        strong={k for k, a in enumerate(content["arms"]) if a["arm"] in by_arm},
        sortable=True,
    )


def _types(content: Content) -> list[Block]:
    blocks: list[Block] = []
    cells: dict[str, Callable[[Content], str]] = {
        "parameter": lambda p: p["name"],
        "mean of arms": lambda p: number(p["mean"]),
        "spread between arms (1 sd)": lambda p: number(p["spread"], 2),
        "from log to log (1 sd)": lambda p: number(p.get("daily"), 2),
        "relative change per kelvin": lambda p: plus_minus(
            p.get("per_kelvin"), p.get("per_kelvin_sd")
        ),
        "unit": lambda p: unit_text(p["unit"]),
    }
    for name, kind in content["types"].items():
        learned = kind["learned_from"]
        caption = (
            f"{name}: learned from {learned['logs']} logs of {learned['arms']} arms; values at"
            f" {setting(kind['reference_temperature_c'])} °C."
        )
        blocks.append(table_of(caption, kind["parameters"], cells, sortable=True))
    return blocks or [Text("No log could be used.")]


def _unseen(content: Content) -> list[Block]:
    """What the logs cannot show, however large it is."""
    blocks: list[Block] = []
    for kind in content["types"].values():
        labels = joint_labels(kind["joints"])
        said = [what_text(s, labels) for s in kind["shown"] if s["size"] is None]
        if said:
            blocks.append(
                Text(f"These motions of {kind['model']} would not show at all: {listed(said)}.")
            )
    return blocks


def _shown(content: Content) -> list[Block]:
    days, blocks = content["settings"]["shown_logs"], []
    for name, kind in content["types"].items():
        labels = joint_labels(kind["joints"])
        rows = [
            [what_text(s, labels), number(s["size"], 2), unit_text(s["unit"])]
            for s in kind["shown"]
        ]
        heads = ("change", "smallest", "unit")
        caption = (
            f"{name}: what {days} logs of the median arm would be expected to tell, beside all logs"
            " before them; of friction the dry part. A dash: not at any size."
        )
        few = f"{name}: its arms have too few logs before their last {days}."
        blocks.append(Table(caption, heads, rows, sortable=True) if rows else Text(few))
    return blocks or [Text("No log could be used.")]


def _refused(content: Content) -> list[Block]:
    if not content["refused"]:
        return [Text("All logs could be used.")]
    rows = [
        [r["log"], " ".join(x.partition(": ")[2] for x in r["remarks"])] for r in content["refused"]
    ]
    return [Table("Logs that were left out.", ("log", "why"), rows, sortable=True)]


def _method(content: Content) -> list[Block]:
    settings, least = content["settings"], content["least_log_odds"]
    asked = (
        "" if least is None else f" Here that asked for odds of 10 to the {number(least / _LN_10)}."
    )
    return [
        Points(
            [
                "Each log is reduced once to the triangles of its regression. An arm's parameters"
                " scatter about those of its type; friction scatters from log to log and follows"
                " the temperature, with slopes that the type shares.",
                "The odds of a change, from any log on and in anything that is looked for, against"
                " none are a test martingale: without a change they exceed c ever with a chance of"
                " 1/c at most, however often they are looked at.",
                "Of all arms that are called changed, the share of false ones is kept below"
                f" {setting(100 * settings['false_alarm_share'])}\u202f% (Benjamini and Hochberg)."
                + asked,
            ]
        )
    ]


def _steps(content: Content) -> list[Step]:
    if not content["changes"]:
        return [Step("Run it again when there are more logs: only new ones are read.")]
    first = max(content["changes"], key=lambda c: c["evidence"])
    why = f"See what `ident gap` finds in the log from which {first['arm']} has changed:"
    return [Step(why, ["ident", "gap", first["first_log"], "--model", "MODEL.yaml"])]
