"""The page of `ident gap`: what is missing, where it shows, and what is left after it was added."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.report.figures import region_map
from ident.report.page import (
    Block,
    Column,
    Gallery,
    Page,
    Points,
    Section,
    Status,
    Table,
    Text,
    Verdict,
)
from ident.report.provenance_section import provenance_section
from ident.report.row_figures import bars, dumbbell
from ident.report.svg import Drawing
from ident.report.words import (
    DASH,
    closed_text,
    effect_text,
    joint_labels,
    joints_text,
    kinds_text,
    known,
    listed,
    number,
    percent,
    plus_minus,
    share,
    unit_text,
)

Array = NDArray[np.floating]
Content = Mapping[str, Any]

_WORDS: dict[str, tuple[Status, str]] = {
    "no_gap": ("good", "nothing missing"),
    "named": ("good", "missing effect named"),
    "ambiguous": ("warning", "several explanations"),
    "unknown": ("open", "unknown effect"),
    "data_fault": ("bad", "fault in the data"),
}

_STEPS = {
    "rigid_body": "rigid body",
    "coulomb": "Coulomb friction",
    "viscous": "viscous friction",
}
_MOST_IN_A_SENTENCE = 3


@dataclass(frozen=True)
class RegionMap:
    """Rms residual of one joint over position and velocity.

    Attributes:
        joint: from 0.
        q, qd: edges of the cells [rad], [rad/s], shapes (X + 1,) and (Y + 1,).
        before, after: [N m], shape (X, Y); not-a-number where there are no data.
    """

    joint: int
    q: Array
    qd: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class GapReport:
    """What the page is made of.

    Attributes:
        content: of `gap.json`.
        arm: its name.
        joints: names.
        titles: of the effects in plain words, by id.
        maps: where the residual is.
        torque: blocks of torque over time, before and after.
        motion: blocks of measured and simulated motion.
        explained: of each effect by id: its signature, and the motion that tells it from others.
    """

    content: Content
    arm: str
    joints: Sequence[str]
    titles: Mapping[str, str]
    maps: Sequence[RegionMap] = ()
    torque: Sequence[Block] = ()
    motion: Sequence[Block] = ()
    explained: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def labels(self) -> list[str]:
        """The joints in print."""
        return joint_labels(self.joints)

    def title(self, effect: str) -> str:
        """An effect in plain words."""
        return self.titles.get(effect, effect.replace("_", " "))

    def of(self, joints: Sequence[int]) -> str:
        """Joints, from 1, in a sentence."""
        if not joints:
            return "the whole arm"
        return joints_text([self.labels[j - 1] for j in joints])


def gap_page(report: GapReport) -> Page:
    """The page of a search for missing effects."""
    content = report.content
    sections = [
        Section("What is missing", _effects(report)),
        Section("Where it shows", _where(report)),
        Section("Before and after, on held-out data", _held_out(report)),
        Section("Torque over time", report.torque),
        Section("Simulation against measurement", [*_forward(report), *report.motion]),
        Section("Structure without a name", _unexplained(report)),
        Section("Other explanations, and how to tell", _rivals(report)),
        Section("What could not be seen", _unseen(report)),
        provenance_section(content),
    ]
    return Page(
        command="ident gap",
        title=f"{report.arm}: what the model misses",
        verdict=_verdict(report),
        figures=_figures(content),
        sections=[s for s in sections if s.blocks],
    )


def _verdict(report: GapReport) -> Verdict:
    status, word = _WORDS[report.content["verdict"]]
    first, *more = verdict_sentences(report)
    return Verdict(status, word, first, more)


def verdict_sentences(report: GapReport) -> list[str]:
    """The answer, and what to know beside it."""
    content = report.content
    effects = kinds_text(content["effects"], report.title, report.of)
    partly = content["verdict"] == "unknown" and bool(effects)
    sentence = {
        "no_gap": "The model explains these recordings down to their noise.",
        "named": f"The model misses {_counted(effects)}.",
        "ambiguous": f"The model misses something that looks like {_counted(effects)},"
        " but these data cannot tell it from other effects.",
        "unknown": "The model misses something that no effect of the catalogue explains.",
        "data_fault": "These recordings cannot be trusted, so that no effect is named"
        + (f": {listed(effects)}." if effects else "."),
    }[content["verdict"]]
    more = [f"Part of it looks like {_counted(effects)}."] if partly else []
    if len(effects) > _MOST_IN_A_SENTENCE and content["verdict"] != "data_fault":
        more.append(f"In full: {'; '.join(effects)}.")
    if partly or content["verdict"] in ("named", "ambiguous"):
        more.append(closed_text(content["held_out"], report.of))
    more += [_what_is_left(report, u) for u in content.get("unexplained", [])]
    if content["verdict"] == "ambiguous":
        more += [_experiment(report, e) for e in content["effects"] if e["separating_experiment"]]
    return [sentence, *(m for m in more if m)]


def _counted(effects: Sequence[str]) -> str:
    if len(effects) <= _MOST_IN_A_SENTENCE:
        return listed(effects)
    return f"{len(effects)} effects, {effects[0]} first"


def _what_is_left(report: GapReport, entry: Content) -> str:
    nearest = [report.title(n["name"]) for n in entry["nearest"]]
    words = f" The nearest of the catalogue: {listed(nearest)}." if nearest else ""
    return (
        f"What is left at {report.of([entry['joint']])} depends on {entry['depends_on']}"
        f" ({share(entry['share_of_residual'], 2)} of its residual).{words}"
    )


def _experiment(report: GapReport, effect: Content) -> str:
    rivals = [f"{report.title(r['name'])} at {report.of(r['joints'])}" for r in effect["rivals"]]
    motion = report.explained.get(effect["name"], ("", ""))[1]
    return (
        f"It may also be {listed(rivals)}."
        + (f" To tell them apart, {motion}:" if motion else " To tell them apart:")
        + f" ident design --for {effect['separating_experiment']}."
    )


def _figures(content: Content) -> list[tuple[str, str]]:
    held_out = content["held_out"]
    names = {
        "before": "held-out error before",
        "after": "held-out error after",
        "noise_floor": "noise floor",
    }
    tiles = [
        (percent(held_out[k]["relative_error_percent"]), text)
        for k, text in names.items()
        if k in held_out
    ]
    return [*tiles, (share(held_out["closed_fraction"], 2), "of the gap closed")]


def _effects(report: GapReport) -> list[Block]:
    blocks: list[Block] = []
    for effect in report.content["effects"]:
        what = f"{report.title(effect['name'])}, {report.of(effect['joints'])}"
        blocks.append(Text(f"{what[0].upper()}{what[1:]}: {effect['equation']}"))
        signature = report.explained.get(effect["name"], ("", ""))[0]
        if signature:
            blocks.append(Text(f"How it shows: {signature}."))
        rows = [
            [name, plus_minus(p["value"], p["sd"]), unit_text(p["unit"])]
            for name, p in effect["parameters"].items()
        ]
        columns = [Column("parameter", "words"), Column("value ± sd"), Column("unit", "words")]
        if rows:
            blocks.append(Table("Its parameters.", columns, rows))
        facts = effect["evidence"]
        if facts:
            rows = [[k.replace("_", " "), _fact(v)] for k, v in facts.items()]
            columns = [Column("evidence", "words"), Column("value")]
            blocks.append(Table("What speaks for it.", columns, rows))
    return blocks


def _fact(value: Any) -> str:
    return number(value) if value is None or isinstance(value, int | float) else str(value)


def _where(report: GapReport) -> list[Block]:
    where = report.content["where"]
    blocks: list[Block] = []
    if where:
        rows = [f"{report.labels[w['joint'] - 1]}, {w['region']}" for w in where]
        shares = [100 * w["share_of_gap"] if known(w["share_of_gap"]) else np.nan for w in where]
        title, quantity = "Share of the gap by joint and region", "share of the gap [%]"
        caption = f"{title}, in units of the noise there."
        blocks.append(Gallery([bars(title, quantity, rows, shares)], caption))
    if report.maps:
        most = max([float(np.nanmax(m.before, initial=0.0)) for m in report.maps]) or 1.0
        drawings: list[Drawing] = []
        for m in report.maps:
            label = report.labels[m.joint]
            axes = ("position [rad]", "velocity [rad/s]")
            drawings.append(region_map(f"{label}, before", axes, (m.q, m.qd), m.before, most))
            drawings.append(region_map(f"{label}, after", axes, (m.q, m.qd), m.after, most))
        caption = (
            "Rms residual over position and velocity, before and after the effect was added: darker"
            f" is larger, up to {number(most)}\u202fN·m; white has no data."
        )
        blocks.append(Gallery(drawings, caption))
    return blocks


def _held_out(report: GapReport) -> list[Block]:
    held_out = report.content["held_out"]
    sides = ("before", "after", "noise_floor")
    blocks = _compared(
        report.labels,
        {side: held_out.get(side, {}).get("rms_by_joint") for side in sides},
        ("Rms residual torque", "rms residual [N·m]"),
    )
    if blocks:
        words = (
            "While the joints move: where one turns round, dry friction is whatever holds it, which"
            " no motion tells. What an effect brings there shows in the simulation below."
        )
        blocks.insert(0, Text(words))
    return [*blocks, *_steps(report)]


def _steps(report: GapReport) -> list[Block]:
    steps = report.content.get("steps", [])
    if not steps:
        return []
    names = [_STEPS.get(s["added"]) or effect_text(s["added"], s["joints"]) for s in steps]
    rows = [name if i == 0 else f"+ {name}" for i, name in enumerate(names)]
    title, quantity = "Held-out error, step by step", "held-out error [%]"
    caption = (
        f"{title}: from the rigid body alone to the model with all effects, each fitted by least"
        " squares."
    )
    sizes = [s["relative_error_percent"] for s in steps]
    return [Gallery([bars(title, quantity, rows, sizes)], caption)]


def _forward(report: GapReport) -> list[Block]:
    forward = report.content.get("forward_simulation") or {}
    blocks = _compared(
        report.labels,
        {side: forward.get(side, {}).get("rms_q_by_joint") for side in ("before", "after")},
        ("Error of the simulated motion", "rms position error [rad]"),
    )
    if blocks:
        words = (
            "The closed loop of controller and model, simulated along the wanted motion, and"
            " compared with the measured one."
        )
        blocks.insert(0, Text(words))
    return blocks


def _compared(
    labels: Sequence[str],
    sides: Mapping[str, Sequence[float | None] | None],
    words: tuple[str, str],
) -> list[Block]:
    """A figure and a table of a number per joint; nothing where there is none before.

    Args:
        labels: of the joints.
        sides: `before`, `after`, and perhaps `noise_floor`; None where unknown.
        words: what the number is, and its axis.
    """
    nothing = [None] * len(labels)
    columns = {k: np.array(v or nothing, dtype=float) for k, v in sides.items()}
    if not np.isfinite(columns["before"]).any():
        return []
    pairs = np.stack([columns["before"], columns["after"]], axis=1)
    floor = columns.get("noise_floor", np.full(len(labels), np.nan))
    heads = [Column("joint", "words"), *(Column(k.replace("_", " ")) for k in columns)]
    rows = [
        [label, *(number(float(c[j])) for c in columns.values())] for j, label in enumerate(labels)
    ]
    title, quantity = words
    caption = f"{title} of each joint, before and after the effect was added."
    return [
        Gallery([dumbbell(title, quantity, labels, pairs, floor)], caption),
        Table(f"The same in numbers: {quantity}.", heads, rows),
    ]


def _unexplained(report: GapReport) -> list[Block]:
    rows = [
        [
            report.labels[u["joint"] - 1],
            u["depends_on"],
            share(u["share_of_residual"], 2),
            listed([report.title(n["name"]) for n in u["nearest"]]) if u["nearest"] else DASH,
        ]
        for u in report.content.get("unexplained", [])
    ]
    if not rows:
        return []
    heads = ("joint", "what is left depends on", "share of the residual", "nearest effects")
    columns = [Column(h, "numbers" if i == 2 else "words") for i, h in enumerate(heads)]
    return [Table("Structure that no effect of the catalogue explains.", columns, rows)]


def _rivals(report: GapReport) -> list[Block]:
    rows = [
        [report.title(r["name"]), report.of(r["joints"]), _fact(r["evidence"])]
        for e in report.content["effects"]
        for r in e["rivals"]
    ]
    if not rows:
        return []
    columns = [Column("effect", "words"), Column("where", "words"), Column("evidence")]
    return [
        Table("Effects that explain the same part of the gap, the nearest first.", columns, rows)
    ]


def _unseen(report: GapReport) -> list[Block]:
    content = report.content
    blocks: list[Block] = []
    if content["not_observable"]:
        sentences = [
            f"{report.title(n['name'])} at {report.of(n['joints'])}"
            for n in content["not_observable"]
        ]
        blocks += [Text("This motion does not show:"), Points(sentences)]
    sizes = content["minimum_detectable"]
    if sizes:
        n = len(report.labels)
        rows = []
        for name, by_joint in sizes.items():
            cells = [number(by_joint.get(str(j + 1), by_joint.get(j + 1))) for j in range(n)]
            rows.append([report.title(name), *cells])
        columns = [Column("effect", "words"), *(Column(label) for label in report.labels)]
        caption = f"Smallest size that would have been seen, in SI units; {DASH} where never."
        blocks.append(Table(caption, columns, rows))
    return blocks
