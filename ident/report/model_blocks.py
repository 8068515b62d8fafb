"""Blocks of the run page on the model: Table I, feasibility, and what is not known."""

from collections.abc import Mapping, Sequence
from typing import Any

from ident.report.page import Block, Column, Points, Table, Text
from ident.report.words import (
    DASH,
    decimals_of,
    estimator_text,
    fixed,
    joint_labels,
    known,
    listed,
    number,
    plus_minus,
    share,
    unit_text,
)

Content = Mapping[str, Any]

_SEVERAL = 12


def parameter_blocks(content: Content) -> list[Block]:
    """Table I."""
    chosen = content["estimator"]
    drawn = any(known(p["cad"]) for p in content["base_parameters"])
    columns = [
        Column("parameter", "words"),
        *([Column("CAD")] if drawn else []),
        Column("OLS ± standard error"),
        Column(estimator_text(chosen)),
        Column("unit", "words"),
    ]
    rows, pale = [], set()
    invisible = set(content["not_identified"]["invisible"])
    for i, p in enumerate(content["base_parameters"]):
        places = min(decimals_of(p["sd"]), 6)
        cells = [plus_minus(p["ols"], p["sd"]), fixed(p[chosen], places), unit_text(p["unit"])]
        rows.append([p["name"], *([fixed(p["cad"], places)] if drawn else []), *cells])
        if p["name"] in invisible:
            pale.add(i)
    caption = (
        "Table I for this arm. Only these combinations of the links' parameters have an effect on"
        " torque. Grey: OLS cannot tell the value from zero (90 % interval)."
    )
    return [Table(caption, columns, rows, pale=frozenset(pale))]


def feasibility_blocks(content: Content) -> list[Block]:
    """Which estimates an arm could have, and what holds the chosen one."""
    chosen = content["estimator"]
    columns = [
        Column("estimator", "words"),
        Column("possible", "words"),
        Column("mass matrix positive at"),
        Column("smallest pseudo-inertia eigenvalue [SI]"),
        Column("negative friction", "words"),
    ]
    rows = [
        [
            estimator_text(name),
            "yes" if e["feasible"] else "no",
            share(e["mass_matrix_positive_fraction"]),
            number(e["min_pseudo_inertia_eigenvalue"], 2),
            listed(e["negative"]) or DASH,
        ]
        for name, e in content["estimators"].items()
    ]
    caption = (
        "A set of base parameters is possible when some arm with positive masses, real inertia"
        " tensors, and friction that brakes has it. The mass matrix is tested at random postures"
        " over the whole joint range."
    )
    place = list(content["estimators"]).index(chosen)
    return [
        Table(caption, columns, rows, strong=frozenset({place})),
        *_constraints(content["active_constraints"], joint_labels(content["joints"])),
    ]


def _constraints(active: Sequence[Content], labels: Sequence[str]) -> list[Block]:
    if not active:
        return [Text("No constraint holds the solution: the data alone gave a possible arm.")]
    columns = [
        Column("link or joint", "words"),
        Column("constraint", "words"),
        Column("where it is tight", "words"),
        Column("multiplier"),
    ]
    rows = [
        [
            labels[a["joint"] - 1] if a["joint"] else "whole arm",
            a["constraint"].replace(">=", "≥").replace("<=", "≤"),
            a.get("direction", DASH),
            number(a["multiplier"], 2),
        ]
        for a in active
    ]
    caption = (
        "Constraints that hold the solution, the strongest first: here the data alone would have"
        " left what is possible. The multiplier says how much the squared error [N²·m²] would fall"
        " per unit by which the bound is lowered (SI unit for friction, the link's own size for its"
        " matrix). A large one points at an effect that the model lacks, or at noise."
    )
    return [Table(caption, columns, rows)]


def limit_blocks(content: Content) -> list[Block]:
    """What could not be identified."""
    limits = content["not_identified"]
    sentences = []
    for key, text in (
        ("without_effect", "parameters have no effect on the torque of the joints that moved"),
        ("only_combined", "parameters show only together with others, as in the table above"),
        ("invisible", "base parameters cannot be told from zero (90 % interval of OLS)"),
    ):
        if limits[key]:
            sentences.append(f"{len(limits[key])} {text}: {_several(limits[key])}.")
    sentences += [
        f"This motion hardly tells apart: {_several(names)}."
        for names in limits["hardly_told_apart"]
    ]
    sentences += [_trial(t) for t in content["terms_tried"]]
    held = [n for n, m in zip(content["joints"], content["moving"], strict=True) if not m]
    if held:
        sentences.append(f"Held still, so that nothing is known of them: {listed(held)}.")
    return [Points(sentences)] if sentences else [Text("Nothing: every parameter shows.")]


def _trial(trial: Content) -> str:
    name = trial["term"].replace("_", " ")
    gain = plus_minus(trial["gain_percent"], trial["sd_percent"])
    verdict = "in the model" if trial["taken"] else "not clear enough, so it is not in the model"
    return (
        f"The term {name} takes {gain} percentage points (± standard error) off the error on data"
        f" that was not fitted: {verdict}."
    )


def _several(names: Sequence[str]) -> str:
    shown = "; ".join(names[:_SEVERAL])
    rest = len(names) - _SEVERAL
    return f"{shown}; and {rest} more" if rest > 0 else shown
