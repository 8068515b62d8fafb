"""The page of `ident gap --method simulation`: positions, not torques."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from ident.report.charts import Chart
from ident.report.figures import beside_measured, recording_figures, row_figure
from ident.report.gap.blocks import VERDICT_WORDS, parameter_table, rival_blocks, where_blocks
from ident.report.gap.report import SearchReport
from ident.report.page import (
    Block,
    Figure,
    Page,
    Points,
    Section,
    Step,
    Table,
    Text,
    Verdict,
    with_trust,
)
from ident.report.provenance_section import provenance_section
from ident.report.servos.run_page import ServoTrace
from ident.report.style import AFTER, BEFORE, FLOOR, WITH, WITHOUT
from ident.report.words import (
    Content,
    kinds_text,
    number,
    part_of_what_is_missing,
    plus_minus,
    share,
)
from wamctl.arm.joint_labels import listed

_WHERE = "Squared error of the simulation without effects, in units of the noise."


@dataclass(frozen=True)
class ServoGap(SearchReport):
    """What the page of a search by simulation is made of, beside the content of `gap.json`.

    Attributes:
        before, after: the recordings beside the simulation without and with the effects.
    """

    unlisted: ClassVar[str] = "the servo's {}"
    model: ClassVar[str] = "servo model"
    driven_by: ClassVar[str] = "commands alone"

    before: tuple[ServoTrace, ...]
    after: tuple[ServoTrace, ...]

    @property
    def moving(self) -> list[int]:
        """The joints that moved, from 0."""
        return np.flatnonzero(self.content["moving"]).tolist()

    def kinds(self, effects: Sequence[Content]) -> str:
        """Effects and where they are, joints of one kind together."""
        places: dict[str, list[int]] = {}
        for e in effects:
            places.setdefault(e["name"], []).extend(e["joints"])
        merged = [{"name": k, "joints": sorted(j)} for k, j in places.items()]
        return listed(kinds_text(merged, self.title, self.of))


@dataclass(frozen=True)
class DrivenGapPage(ServoGap):
    """The same of an arm that recorded torque drives."""

    unlisted: ClassVar[str] = "{}"
    model: ClassVar[str] = "model"
    driven_by: ClassVar[str] = "the recorded torque"


def verdict_sentences(report: ServoGap) -> list[str]:
    """The answer, and what to know beside it."""
    content, effects = report.content, report.kinds(report.content["effects"])
    first = {
        "no_gap": f"The {report.model} misses nothing that these positions show clearly.",
        "named": f"The {report.model} misses {effects}.",
        "ambiguous": f"The {report.model} misses something that looks like {effects}, but these"
        " recordings cannot tell it from other effects.",
        "unknown": f"The {report.model} misses something that none of the effects asked for"
        " explains.",
    }[content["verdict"]]
    if content["verdict"] == "unknown" and effects:
        part = part_of_what_is_missing(content["held_out"]["closed_fraction"])
        first = f"{part} looks like {effects}; none of the effects asked for explains the rest."
    more = []
    if effects:
        more.append(_closed(report))
    for e in content["effects"]:
        if e["rivals"]:
            rivals = listed([report.title(r["name"]) for r in e["rivals"]])
            text = f"At {report.of(e['joints'])}, {report.title(e['name'])} may also be {rivals}."
            motion = report.experiment(e["name"])
            more.append(text + (f" To tell them apart, {motion}." if motion else ""))
    for s in content["suspected"]:
        what = f"{report.title(s['name'])} at {report.of(s['joints'])}"
        more.append(f"Suspected, not named and not in the model: {what}; {s['doubt']}.")
    if left := content["unexplained"]:
        rms, floor = (listed([number(1e3 * u[k]) for u in left]) for k in ("rms", "noise_floor"))
        more.append(
            f"At {report.of([u['joint'] for u in left])} the simulation stays {rms} mrad (rms of"
            f" the typical second) from the measurement on held-out motions, where noise alone"
            f" gives {floor} mrad."
        )
    return [first, *more]


def _closed(report: ServoGap) -> str:
    held = report.content["held_out"]
    joints = sorted({j for e in report.content["effects"] for j in e["joints"]})
    sides = [
        np.sqrt(np.mean([held[k]["rms_by_joint"][j - 1] ** 2 for j in joints]))
        for k in ("before", "after")
    ]
    before, after = (number(1e3 * float(x)) for x in sides)
    return (
        f"Adding it closes {share(held['closed_fraction'], 2)} of the gap: on held-out motions the"
        f" simulation of {report.of(joints)} is {after} mrad from the measurement"
        f" ({held['measure']}), where it was {before} mrad."
    )


def servo_gap_page(report: ServoGap) -> Page:
    """The page of a search by simulation."""
    content = report.content
    status, word = VERDICT_WORDS[content["verdict"]]
    first, *more = verdict_sentences(report)
    sections = [
        Section("What is missing", _effects(report)),
        Section("Where it shows", where_blocks(content["where"], report.labels, _WHERE)),
        Section("Error on held-out motions", _held_out(report)),
        Section("Measured and simulated positions", _positions(report)),
        Section("Other explanations", rival_blocks(report)),
        Section("What could have been seen", _seen(report)),
        Section(f"The {report.model}", _servo(report)),
        provenance_section(content),
    ]
    held, tiles = content["held_out"], []
    for side, words in (("before", "without effects"), ("after", "with them")):
        rms = [x for x in held[side]["rms_by_joint"] if x is not None]
        if side == "before" or content["effects"]:
            value = number(1e3 * float(np.sqrt(np.mean(np.square(rms)))))
            tiles.append((f"{value} mrad", f"{held['measure']} on held-out motions, {words}"))
    return Page(
        command="ident gap",
        title=f"{content['arm']}: what the {report.model} misses",
        verdict=with_trust(Verdict(status, word, first, more), content, "trust"),
        figures=tiles,
        sections=[s for s in sections if s.blocks],
        steps=_steps(content),
    )


def _effects(report: ServoGap) -> list[Block]:
    blocks: list[Block] = []
    for e in report.content["effects"]:
        what = f"{report.title(e['name'])}, {report.of(e['joints'])}"
        signature, facts = report.signature(e["name"]), e["evidence"]
        blocks.append(Text(f"{what[0].upper()}{what[1:]}. In the simulation: `{e['equation']}`"))
        if signature:
            blocks.append(Text(f"How it shows in general: {signature}."))
        gain, asked = (number(facts[f"{k}_nats_per_sample"], 2) for k in ("gain", "asked"))
        blocks.append(
            Text(
                f"Evidence: it needed {asked}, and has {gain} (log-likelihood gained per sample of"
                f" held-out motion); {facts['confirmed_parts']} of {facts['held_out_parts']} parts"
                " of the recordings, each predicted by a fit to the others, are simulated better"
                " with it."
            )
        )
        blocks.append(parameter_table(e))
    return blocks


def _held_out(report: ServoGap) -> list[Block]:
    held = report.content["held_out"]
    sides = {"before": ("without effects", BEFORE), "noise_floor": ("noise floor", FLOOR)}
    if report.content["effects"]:
        sides["after"] = ("with effects", AFTER)
    labels = [report.labels[j] for j in report.moving]
    values = {
        words: (sign, [1e3 * held[k]["rms_by_joint"][j] for j in report.moving])
        for k, (words, sign) in sides.items()
    }
    caption = (
        "Stretches of time, each predicted from a fit of all the others and simulated from"
        f" {report.driven_by}. The noise floor is the same of a simulated arm that misses nothing:"
        " encoder steps and white noise."
    )
    title, quantity = f"Position error of each joint, {held['measure']}", "error [mrad]"
    return [row_figure(title, caption, quantity, labels, values)]


def _positions(report: ServoGap) -> list[Block]:
    joints = list(dict.fromkeys(w["joint"] - 1 for w in report.content["where"])) or report.moving
    caption = (
        "Below: measured less simulated position, without and with the effects, in a fit to"
        " all recordings."
    )

    def figure(pair: tuple[ServoTrace, ServoTrace]) -> Figure:
        rms = [1e3 * np.sqrt(np.mean((x.measured - x.simulated) ** 2, axis=0)) for x in pair]
        rows = [[report.labels[j], *(number(float(x[j])) for x in rms)] for j in joints]
        heads = ("joint", "without [mrad]", "with [mrad]")
        table = Table("Rms of measured less simulated.", heads, rows)
        charts = [_chart(report, *pair, j) for j in joints]
        return Figure(Path(pair[0].name).name, caption, charts, table)

    return recording_figures(list(zip(report.before, report.after, strict=True)), figure)


def _chart(report: ServoGap, old: ServoTrace, new: ServoTrace, j: int) -> Chart:
    models = {"without effects": (WITHOUT, old.simulated[:, j])}
    if report.content["effects"]:
        models["with effects"] = (WITH, new.simulated[:, j])
    return beside_measured(report.labels[j], old.t, "position [rad]", old.measured[:, j], models)


def _seen(report: ServoGap) -> list[Block]:
    content = report.content
    units = content["detectable_units"]
    heads = ["effect", "unit", *(report.labels[j] for j in report.moving)]
    rows = [
        [
            report.title(name),
            units[name],
            *(number(sizes.get(str(j + 1)), 2) for j in report.moving),
        ]
        for name, sizes in content["minimum_detectable"].items()
    ]
    caption = (
        "The smallest size that could have been named; a dash: none could, or the effect is named."
    )
    reasons = [f"{report.title(k)}: {why}" for k, why in content["not_asked"].items()]
    blocks: list[Block] = [Table(caption, heads, rows)]
    if held := content["held_by_weight"]:
        blocks.append(
            Text(
                f"At {report.of(held)}, weight keeps the gears on one flank throughout: these"
                " motions never cross the backlash there, and no positions can tell its size."
                " Poses in which weight pulls the other way would show it."
            )
        )
    return [*blocks, Text("Not asked for:"), Points(reasons)]


def _servo(report: ServoGap) -> list[Block]:
    rows = []
    for q in report.content["servo"]:
        name, sd = q["name"].replace("_", " "), q.get("sd", [None] * len(q["after"]))
        if report.content["effects"]:
            cells = (number(q["before"][j]) for j in report.moving)
            rows.append([f"{name}, without effects", q["unit"], *cells])
            name += ", with effects"
        ended = [plus_minus(*pair) for pair in zip(q["after"], sd, strict=True)]
        rows.append([name, q["unit"], *(ended[j] for j in report.moving)])
    heads = ["what", "unit", *(report.labels[j] for j in report.moving)]
    return [Table(f"Settings of the {report.model} (± standard error).", heads, rows)]


def _steps(content: Content) -> list[Step]:
    test = ["ident", "validate", "OTHER.mcap", "--model", "model.yaml"]
    export = ["ident", "export", "model.yaml", "--to", "mjcf", "--out", "arm.xml"]
    return [
        Step("Test the model on a recording that was not used here:", test),
        Step("Use the arm in MuJoCo:", export),
    ]
