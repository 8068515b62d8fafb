"""The sentences of a gap: the verdict, the evidence, and what to do next."""

from collections.abc import Sequence
from pathlib import Path

from ident.effects.catalogue import catalogue
from ident.effects.effect import ExperimentMotion
from ident.report.gap.report import GapReport
from ident.report.page import Step
from ident.report.words import (
    Content,
    closed_text,
    input_words,
    kinds_text,
    known,
    number,
    part_of_what_is_missing,
    percent,
    quantity_text,
    share,
    with_unit,
)
from wamctl.arm.joint_labels import listed

_MOST_IN_A_SENTENCE = 3

_SURE = 3.0
"""Standard errors by which a term that is told lies from zero."""

_NEAR_NOISE = 1.5
"""Times the noise that repeats tell: what is left of more is not all noise."""

_SMALL = 0.02
"""Of the gap that was there: what is left of less needs no name of its own."""


def verdict_sentences(report: GapReport) -> list[str]:
    """The answer, and what to know beside it."""
    content = report.content
    effects = kinds_text(content["effects"], report.title, report.of)
    partly = content["verdict"] == "unknown" and bool(effects)
    sentence = {
        "no_gap": _nothing_found(content["held_out"]),
        "named": f"The model misses {_counted(effects)}.",
        "ambiguous": f"The model misses something that looks like {_counted(effects)},"
        " but these data cannot tell it from other effects.",
        "unknown": _unknown(content, effects),
        "data_fault": "These recordings cannot be trusted, so no effect is named"
        + (f": {listed(effects)}." if effects else "."),
    }[content["verdict"]]
    more = []
    if len(effects) > _MOST_IN_A_SENTENCE and content["verdict"] != "data_fault":
        more.append(f"In full: {'; '.join(effects)}.")
    if partly or content["verdict"] in ("named", "ambiguous"):
        more.append(closed_text(content["held_out"], report.of, len(content["effects"])))
        more.append(_usual_terms(content["effects"]))
        more.append(_as_validated(content.get("errors", [])))
    more.append(_friction(report))
    more += suspected_sentences(report)
    more += [_what_is_left(report, u) for u in content.get("unexplained", [])]
    if content["verdict"] == "ambiguous":
        more += [_experiment(report, e) for e in content["effects"] if e["separating_experiment"]]
    return [sentence, *(m for m in more if m)]


def _nothing_found(held_out: Content) -> str:
    """That all but noise is explained; or, where repeats do not tell so, what is left."""
    floor, after = (held_out[k]["relative_error_percent"] for k in ("noise_floor", "after"))
    if floor is not None and not (known(after) and after > _NEAR_NOISE * floor):
        return "The model explains these recordings down to their noise."
    nothing = (
        f"Nothing in what the model leaves, {percent(after)} of the torque, shows an effect of the"
        " catalogue"
    )
    if floor is not None:
        more = f"motion that repeats differs by only {percent(floor)}, so not all of it is noise."
        return f"{nothing}; {more}"
    return (
        f"{nothing}; whether all of it is noise is not known, since no motion repeats closely"
        " enough to tell."
    )


def _unknown(content: Content, effects: Sequence[str]) -> str:
    """What is known of a gap, and why the rest of it has no name."""
    unsure = any(not s["in_model"] for s in content.get("suspected", []))
    if unsure and not content.get("unexplained"):
        why, rest = "that these data are not enough to name", "these data are not enough to name"
    else:
        why = "that no effect of the catalogue explains"
        rest = "no effect of the catalogue explains"
    if not effects:
        return f"The model misses something {why}."
    part = part_of_what_is_missing(_told_share(content))
    return f"{part} looks like {_counted(effects)}; {rest} the rest."


def _told_share(content: Content) -> float | None:
    """The share of the gap that effects close: of the arm's torque if another joint keeps its own.

    In units of their noise, four light joints outweigh a heavy one.
    """
    held_out = content["held_out"]
    closed = held_out["closed_fraction"]
    at = {j for e in content["effects"] for j in e["joints"]}
    before, after, floor = (
        held_out[k]["relative_error_percent"] for k in ("before", "after", "noise_floor")
    )
    if not known(closed) or not known(before) or not known(after):
        return None
    if at.issuperset(u["joint"] for u in content.get("unexplained", [])):
        return closed
    noise = min(floor, after) if known(floor) else 0.0
    gap = before**2 - noise**2
    return min(closed, 1.0 - (after**2 - noise**2) / gap) if gap > 0.0 else None


def _usual_terms(effects: Sequence[Content]) -> str:
    """That a part of the gap is closed by terms that `ident run` has as well."""
    usual = [e["name"] in catalogue() and catalogue()[e["name"]].usual_term != "" for e in effects]
    if not any(usual):
        return ""
    if len(usual) == 1:
        return "This is a term that `ident run` adds as well where it predicts better."
    which = "These" if all(usual) else "Offsets and motors' rotors"
    return f"{which} are terms that `ident run` adds as well where they predict better."


def _as_validated(errors: Sequence[Content]) -> str:
    """The error that the other commands tell, reversals included."""
    if not errors:
        return ""
    told = [f"{percent(e['relative_error_percent'])} on {Path(e['name']).name}" for e in errors]
    return (
        "By the measure of `ident run` and `ident validate`, which counts more of the moments at"
        f" which joints turn round, the model's error is {listed(told)}."
    )


def _friction(report: GapReport) -> str:
    """That friction is not that of the reference model any more: the search fits it anew."""
    told = sorted(
        report.content.get("friction", []),
        key=lambda f: -f["relative_error_percent"]["reference"],
    )
    if not told:
        return ""
    parameters, error = told[0]["parameters"], told[0]["relative_error_percent"]
    name, most = max(parameters.items(), key=lambda item: _relative_change(item[1]))
    now, was = (with_unit(most[k], most["unit"]) for k in ("value", "reference"))
    kind = "Coulomb" if name == "coulomb" else name
    where = report.of(sorted(j for f in told for j in f["joints"]))
    return (
        f"Friction has changed since the reference model at {where}, and was fitted anew: at"
        f" {report.of(told[0]['joints'])}, {kind} friction is {now} instead of {was}. With that of"
        f" the reference model the error there would be {percent(error['reference'])} instead of"
        f" {percent(error['value'])}."
    )


def _relative_change(parameter: Content) -> float:
    was = abs(parameter["reference"])
    return abs(parameter["value"] - parameter["reference"]) / max(was, 1e-12)


def suspected_sentences(report: GapReport) -> list[str]:
    """The effects that are not sure enough to be named, and why the first is not."""
    apart = report.content.get("suspected", [])
    kinds = [
        kinds_text([s for s in apart if s["in_model"] is kept], report.title, report.of)
        for kept in (False, True)
    ]
    words = []
    if kinds[0]:
        why = next(s["doubt"] for s in apart if not s["in_model"])
        words.append(f"Suspected, not named and not in the model: {_counted(kinds[0])}; {why}.")
    if kinds[1]:
        words.append(
            f"In the model without a name, since it predicts better so: {_counted(kinds[1])}."
        )
    if terms := kinds_text(sure_terms(report), report.title, report.of):
        words.append(
            f"The model also holds {listed(terms)}, as terms that `ident run` fits at all joints."
        )
    return words


def sure_terms(report: GapReport) -> list[Content]:
    """The terms of the model that are surely not zero."""
    return [
        t
        for t in report.content.get("terms", [])
        if any(
            known(p["sd"]) and abs(p["value"]) > _SURE * p["sd"] for p in t["parameters"].values()
        )
    ]


def _counted(effects: Sequence[str]) -> str:
    if len(effects) <= _MOST_IN_A_SENTENCE:
        return listed(effects)
    return f"{len(effects)} kinds of effects, {effects[0]} first"


def _what_is_left(report: GapReport, entry: Content) -> str:
    part = share(entry["share_of_residual"], 2)
    left = (
        f"Of what is then left at {report.of([entry['joint']])}, {part} depends on"
        f" {entry['depends_on']}"
    )
    if entry["unexplained"] < _SMALL:
        return f"{left}: less than {share(_SMALL, 1)} of the gap that was there."
    more = _unsearched(report, entry)
    if not entry["nearest"]:
        return f"{left}.{more}"
    best = entry["nearest"][0]
    return (
        f"{left}. The catalogue explains at most {share(best['share_of_residual'], 2)} of it, and"
        f" not surely: at {report.of(best['joints'])}, {report.title(best['name'])}.{more}"
    )


def _unsearched(report: GapReport, entry: Content) -> str:
    """What was not looked for where a torque comes again with a joint's angle, and why."""
    if not entry["depends_on"].startswith("the angle of"):
        return ""
    return "".join(f" {text}" for text in unsearched_texts(report))


def unsearched_texts(report: GapReport) -> list[str]:
    """What was not looked for, and what the arm's file would have to say for it."""
    return [
        f"Not looked for: {report.title(n['name'])}, which asks of the arm's file {n['lacks']}."
        for n in report.content["not_observable"]
        if "lacks" in n
    ]


def _experiment(report: GapReport, effect: Content) -> str:
    rivals = [f"{report.title(r['name'])} at {report.of(r['joints'])}" for r in effect["rivals"]]
    motion = report.experiment(effect["name"])
    return (
        f"It may also be {listed(rivals)}."
        + (f" To tell them apart, {motion}:" if motion else " To tell them apart:")
        + f" ident design --for {effect['separating_experiment']}."
    )


def evidence_text(report: GapReport, effect: Content) -> str:
    """What speaks for an effect, in a sentence; nothing where the file says nothing of it."""
    facts = effect["evidence"]
    if not known(facts.get("gain_nats_per_sample")):
        count = facts.get("count")
        return f"Found {count} times." if count else ""
    asked, gain = (number(facts[f"{k}_nats_per_sample"], 2) for k in ("asked", "gain"))
    parts = [f"Evidence: it needed {asked}, and has {gain} (log-likelihood gained per sample)"]
    if known(facts.get("standard_deviations")):
        parts.append(
            f"its size is {number(facts['standard_deviations'], 2)} standard deviations from zero"
        )
    if facts.get("held_out_parts"):
        parts.append(
            f"confirmed on {facts['confirmed_parts']} of {facts['held_out_parts']} parts of the"
            " recordings, each with the size that the others give it"
        )
    if facts.get("effect_free_runs"):
        runs = facts["effect_free_runs"]
        parts.append(f"none of {runs} effect-free simulations of this arm looks like it")
    name, _, joints = facts.get("next_best", "").partition(" at ")
    places = [int(j) for j in joints.strip("[]").split(",") if j.strip()]
    if name and not any(r["name"] == name and r["joints"] == places for r in effect["rivals"]):
        rival = f"{report.title(name)} at {report.of(places)}"
        parts.append(
            f"the next best explanation, {rival}, has {number(facts['next_best_gain'], 2)}"
        )
    return "; ".join(parts) + "."


def leaning_texts(report: GapReport, effect: Content) -> list[str]:
    """What an effect's values rest on: other effects beside it, and what no data of here test."""
    facts = effect["evidence"]
    texts = [
        f"Its {quantity_text(on['parameter'])} leans on {report.title(on['name'])} at"
        f" {report.of(on['joints'])}: without that effect it would be"
        f" {with_unit(on['value_without'], on['unit'])}."
        for on in facts.get("leans_on", [])
    ]
    return [*texts, *([facts["taken_for_granted"]] if facts.get("taken_for_granted") else [])]


def steps_text(report: GapReport) -> list[Step]:
    """What to do next."""
    content = report.content
    words = input_words(content)
    design = ["ident", "design", "--config", "ARM.yaml", "--for"]
    check = ["ident", "validate", "OTHER.mcap", "--model", "model.yaml"]
    wanted = [e["separating_experiment"] for e in content["effects"] if e["separating_experiment"]]
    steps = [
        Step("Record the motion that tells the explanations apart, and search again:", [*design, w])
        for w in dict.fromkeys(wanted)
    ]
    if content["verdict"] == "data_fault":
        return [
            Step("Mend the recording, or record again, and search again:", ["ident", "gap", *words])
        ]
    if report.named:
        fit = ["ident", "run", *words, "--effects", "model.yaml"]
        steps.append(Step("Fit a model beside the effects that were named:", fit))
        simulate = ["ident", "simulate", "--model", "model.yaml", "--out", "simulated.mcap"]
        steps.append(Step("Simulate the arm with them:", simulate))
    steps.append(Step("Test the model on a recording that was not used here:", check))
    if not content["effects"]:
        unseen = [n["name"] for n in content["not_observable"] if "lacks" not in n]
        hidden = unseen[:1] or [_slow_effect()]
        steps.append(
            Step("Record a motion that shows what this one could not:", [*design, *hidden])
        )
    return steps


def _slow_effect() -> str:
    """An effect that slow reversals show: nearly every recording has too few of them."""
    slow = ExperimentMotion.SLOW_REVERSALS
    return next(e.id for e in catalogue().values() if e.motion is slow)
