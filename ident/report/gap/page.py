"""The page of `ident gap`: what is missing, where it shows, and what is left after it was added."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ident.report.figures import row_figure
from ident.report.gap.blocks import VERDICT_WORDS, parameter_table, rival_blocks, where_blocks
from ident.report.gap.report import GapReport
from ident.report.gap.words import (
    evidence_text,
    leaning_texts,
    steps_text,
    unsearched_texts,
    verdict_sentences,
)
from ident.report.page import (
    Block,
    Page,
    Points,
    Section,
    Table,
    Text,
    Verdict,
    table_of,
    with_trust,
)
from ident.report.provenance_section import provenance_section
from ident.report.style import AFTER, BEFORE, BLUE, FLOOR, Sign
from ident.report.words import (
    DASH,
    Content,
    closed_share,
    effect_text,
    known,
    number,
    percent,
    plus_minus,
    quantity_text,
    share,
    unit_text,
    whole,
    with_unit,
)
from wamctl.arm.joint_labels import listed

_STEPS = {
    "rigid_body": "rigid body",
    "coulomb": "Coulomb friction",
    "viscous": "viscous friction",
}
_WHERE = (
    "By joint, while it slides (above the speed at which friction changes its direction) or stands"
    " still and turns round (below it), in units of the noise there."
)
_SIZES = {
    "coulomb_1": "Coulomb friction",
    "coulomb_change": "change of Coulomb friction",
    "error": "relative error",
    "sine": "amplitude",
}
"""The coefficient that is an effect's size, where its name says little."""

_RESIDUAL = (
    "The residual is the measured torque minus the model's, averaged over windows of a fraction of"
    " a second, on the part of the recordings that no fit has seen. A joint slides where it moves"
    " faster than the speed at which friction changes its direction; elsewhere it stands still or"
    " turns round, and friction may hold it with any torque up to its own. The two are told apart"
    " here, and the held-out error counts sliding only."
)


def gap_page(report: GapReport) -> Page:
    """The page of a search for missing effects."""
    content = report.content
    seen = Section("What could have been seen", _seen(report))
    sections = [
        *([] if report.named else [seen]),
        Section("What is missing", _effects(report)),
        Section("Where it shows", _where(report)),
        Section("Residual on held-out data", _held_out(report)),
        Section("Torque over time", report.torque),
        Section("Simulation against measurement", [*_forward(report), *report.motion]),
        Section("Suspected, and usual terms", [*_suspected(report), *_terms(report)]),
        Section("Friction since the reference model", _friction(report)),
        Section("Structure without a name", [*_unexplained(report), *report.left]),
        Section("Other explanations, and how to tell", rival_blocks(report)),
        *([seen] if report.named else []),
        Section("The recordings", _recordings(report)),
        provenance_section(content),
    ]
    status, word = VERDICT_WORDS[content["verdict"]]
    if content["verdict"] == "no_gap" and content.get("friction"):
        status, word = "warning", "friction has changed"
    first, *more = verdict_sentences(report)
    return Page(
        command="ident gap",
        title=f"{content['arm']}: what the model misses",
        verdict=with_trust(Verdict(status, word, first, more), content, "trust"),
        figures=_figures(report),
        sections=[s for s in sections if s.blocks],
        steps=steps_text(report),
    )


def _figures(report: GapReport) -> list[tuple[str, str]]:
    held_out = report.content["held_out"]
    sides = _sides(report)
    tiles = [
        (percent(held_out[k]["relative_error_percent"]), f"held-out error while sliding{words}")
        for k, words in sides.items()
        if known(held_out.get(k, {}).get("relative_error_percent"))
    ]
    closed = [(closed_share(held_out["closed_fraction"]), "of the gap closed")]
    return [*tiles, *(closed if report.named else [])]


def _sides(report: GapReport) -> dict[str, str]:
    """Parts of `held_out` that differ from each other, and their words."""
    if not report.named:
        return {"before": "", "noise_floor": ", noise alone"}
    return {"before": ", without it", "after": ", with it", "noise_floor": ", noise alone"}


def _effects(report: GapReport) -> list[Block]:
    blocks: list[Block] = []
    curves = iter(report.curves)
    for effect in report.content["effects"]:
        what = f"{report.title(effect['name'])}, {report.of(effect['joints'])}"
        blocks.append(Text(f"{what[0].upper()}{what[1:]}."))
        blocks.append(Text(f"Equation: `{effect['equation']}`"))
        signature = report.signature(effect["name"])
        if signature:
            blocks.append(Text(f"How it shows: {signature}."))
        evidence = evidence_text(report, effect)
        if evidence:
            blocks.append(Text(evidence))
        blocks += [Text(text) for text in leaning_texts(report, effect)]
        curve = next(curves, None)
        blocks += [parameter_table(effect)] if effect["parameters"] else []
        blocks += [curve] if curve is not None else []
    return blocks


def _where(report: GapReport) -> list[Block]:
    told = [Text(text) for text in report.acts]
    return [*told, *where_blocks(report.content["where"], report.labels, _WHERE)]


def _held_out(report: GapReport) -> list[Block]:
    held_out, words = report.content["held_out"], _sides(report)
    signs = {"before": BEFORE, "after": AFTER, "noise_floor": FLOOR}
    sizes = {k: held_out.get(k, {}).get("rms_by_joint") for k in words}
    found = {k: v for k, v in sizes.items() if v and any(map(known, v))}
    if "before" not in found:
        return _steps(report)
    names = {"before": "without it", "after": "with it", "noise_floor": "noise floor"}
    names |= {} if report.named else {"before": "model"}
    moving, labels = report.moving, [report.labels[j] for j in report.moving]
    values = {names[k]: (signs[k], [v[j] for j in moving]) for k, v in found.items()}
    turning = () if report.turning is None else report.turning[: 2 if report.named else 1]
    more = {
        f"turning round: {name} [N·m]": [number(float(side[j])) for j in moving]
        for name, side in zip(list(values)[:2], turning, strict=False)
    }
    figure = row_figure(
        "Rms residual of each joint while it slides",
        "The noise floor is what differs from one repetition of the motion to the next.",
        "rms residual [N·m]",
        labels,
        values,
        more=more,
        joined="after" in found,
    )
    return [Text(_RESIDUAL), figure, *_steps(report)]


def _steps(report: GapReport) -> list[Block]:
    steps = report.content.get("steps", [])
    if not steps:
        return []
    names = [_STEPS.get(s["added"]) or effect_text(s["added"], s["joints"]) for s in steps]
    rows = [name if i == 0 else f"+ {name}" for i, name in enumerate(names)]
    caption = (
        "From the rigid body alone to the model with all effects, each fitted by least squares and"
        " tested on held-out data while the joints slide."
    )
    values = {"error": (Sign(BLUE, "bar"), [s["relative_error_percent"] for s in steps])}
    title, quantity = "Held-out error, step by step", "held-out error [%]"
    return [row_figure(title, caption, quantity, rows, values, head="model")]


def _forward(report: GapReport) -> list[Block]:
    forward = report.content.get("forward_simulation") or {}
    sides = {"before": ("without it", BEFORE), "after": ("with it", AFTER)}
    if not report.named:
        sides = {"before": ("model", BEFORE)}
    labels = [report.labels[j] for j in report.moving]
    nothing = [None] * len(report.labels)
    found = {k: forward.get(k, {}).get("rms_q_by_joint") or nothing for k in sides}
    sizes = {
        words: (sign, [found[k][j] for j in report.moving]) for k, (words, sign) in sides.items()
    }
    if not any(known(v) for _, column in sizes.values() for v in column):
        return []
    caption = (
        "The closed loop of controller and model, simulated along the wanted motion and compared"
        " with the measured one."
    )
    title, quantity = "Error of the simulated motion", "rms position error [rad]"
    joined = len(sizes) > 1
    return [row_figure(title, caption, quantity, labels, sizes, joined=joined)]


def _nearest(report: GapReport, effect: Content) -> str:
    explained = share(effect["share_of_residual"], 2)
    return f"{report.title(effect['name'])} at {report.of(effect['joints'])} ({explained})"


def _unexplained(report: GapReport) -> list[Block]:
    return _unless_empty(
        "Structure that no effect of the catalogue explains.",
        report.content.get("unexplained", []),
        {
            "joint": lambda u: report.labels[u["joint"] - 1],
            "what is left depends on": lambda u: u["depends_on"],
            "share of the residual": lambda u: share(u["share_of_residual"], 2),
            "nearest effects": lambda u: (
                listed([_nearest(report, n) for n in u["nearest"]]) or DASH
            ),
        },
    )


def _suspected(report: GapReport) -> list[Block]:
    return _unless_empty(
        "Effects that help prediction and are not sure enough to be named.",
        report.content.get("suspected", []),
        {
            "effect": lambda s: report.title(s["name"]),
            "where": lambda s: report.of(s["joints"]),
            "standard deviations": lambda s: number(s["evidence"]["standard_deviations"], 2),
            "in the model": lambda s: "yes" if s["in_model"] else "no",
            "why it is not named": lambda s: s["doubt"],
        },
    )


def _terms(report: GapReport) -> list[Block]:
    def size(term: Content) -> str:
        (value,) = term["parameters"].values()
        return plus_minus(value["value"], value["sd"], value["unit"])

    return _unless_empty(
        "Terms that the model holds beside them, as `ident run` fits them at all joints.",
        report.content.get("terms", []),
        {
            "term": lambda t: report.title(t["name"]),
            "where": lambda t: report.of(t["joints"]),
            "size": size,
        },
    )


def _friction(report: GapReport) -> list[Block]:
    def change(name: str) -> Callable[[Content], str]:
        def cell(entry: Content) -> str:
            p = entry["parameters"][name]
            return f"{number(p['reference'])} \u2192 {with_unit(p['value'], p['unit'])}"

        return cell

    def error(entry: Content) -> str:
        left = entry["relative_error_percent"]
        return f"{number(left['reference'])} \u2192 {percent(left['value'])}"

    return _unless_empty(
        "Friction of the reference model, and as it was fitted anew, where the former leaves more.",
        report.content.get("friction", []),
        {
            "where": lambda f: report.of(f["joints"]),
            "Coulomb friction": change("coulomb"),
            "viscous friction": change("viscous"),
            "error of the joint": error,
        },
    )


def _unless_empty(
    caption: str, items: Sequence[Content], cells: Mapping[str, Callable[[Content], str]]
) -> list[Block]:
    return [table_of(caption, items, cells)] if items else []


def _recordings(report: GapReport) -> list[Block]:
    return _unless_empty(
        "What was searched, and what was repaired or left out before.",
        report.content["logs"],
        {
            "recording": lambda log: Path(log["name"]).name,
            "samples": lambda log: whole(log["samples"]),
            "remarks": lambda log: "; ".join(log["remarks"]) or DASH,
        },
    )


def _seen(report: GapReport) -> list[Block]:
    content = report.content
    blocks: list[Block] = []
    sizes = content["minimum_detectable"]
    if sizes:
        joints = [j + 1 for j in report.moving]
        heads = ["effect", "size", *(report.labels[j] for j in report.moving)]
        rows = []
        for name, by_joint in sizes.items():
            coefficient, unit = report.sizes.get(name, ("", ""))
            said = _SIZES.get(coefficient) or quantity_text(coefficient)
            size = f"{said} [{unit_text(unit)}]" if unit else DASH
            found = [by_joint.get(str(j), by_joint.get(j)) for j in joints]
            rows.append([report.title(name), size, *(number(x, 2) for x in found)])
        caption = f"The smallest size that could have been named, by joint; {DASH}: none could."
        blocks.append(Table(caption, heads, rows))
    held = {j + 1 for j in range(len(report.labels))} - {j + 1 for j in report.moving}
    if held:
        blocks.append(Text(f"Held still, so they show nothing: {report.of(sorted(held))}."))
    hidden = []
    blocks += [Text(text) for text in unsearched_texts(report)]
    for entry in (e for e in content["not_observable"] if "lacks" not in e):
        joints = [j for j in entry["joints"] if j not in held]
        if joints or not entry["joints"]:
            where = f" at {report.of(joints)}" if joints else ""
            hidden.append(f"{report.title(entry['name'])}{where}")
    return [*blocks, Text("Not to be told by this motion:"), Points(hidden)] if hidden else blocks
