"""Blocks of the run page on the model: friction, Table I, feasibility, and what is not known."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.report.charts import Curve, Panel, line_chart, map_chart
from ident.report.page import Block, Column, Figure, Points, Table, Text
from ident.report.run_curves import FrictionCurve
from ident.report.style import BLUE, ORANGE, Sign
from ident.report.words import (
    DASH,
    decimals_of,
    estimator_text,
    fixed,
    known,
    number,
    plus_minus,
    share,
    unit_text,
)
from wamctl.arm.joint_labels import joint_labels, listed

Content = Mapping[str, Any]

_SEVERAL = 12
_EVERY = 4  # so many points of a friction curve make one row of its table
_STRONGEST = 20  # correlations in the table


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
        "The base parameters (the paper's Table I): only these combinations of the links' masses,"
        " centres of mass, and inertias affect the torque. CAD: value by the arm's own file. OLS:"
        " ordinary least squares. Grey: OLS cannot tell the value from zero (90 % interval)."
    )
    return [Table(caption, columns, rows, pale=frozenset(pale))]


def gain_blocks(content: Content) -> list[Block]:
    """Torque per ampere, where efforts were currents."""
    basis = {
        "given": "given with the arm",
        "weight": "masses in the URDF",
        "links": "links that joints share",
        "load": "the known load",
        "none": "nothing: the others' common factor",
    }
    names = joint_labels(content["joints"])
    rows = [
        [
            names[g["joint"] - 1],
            plus_minus(g["nm_per_ampere"], g["sd"])
            if known(g["sd"])
            else number(g["nm_per_ampere"]),
            basis[g["from"]],
        ]
        for g in content["gains"]
    ]
    caption = (
        "Torque per ampere, ± standard error. The arm's parameters in N m, kg m or kg m² hold up to"
        " these; run.json holds the base parameters in ampere too, which do not depend on them."
    )
    columns = [Column("joint", "words"), Column("gain [N·m/A]"), Column("known from", "words")]
    return [Table(caption, columns, rows)]


def friction_blocks(curves: Sequence[FrictionCurve], labels: Sequence[str]) -> list[Block]:
    """Friction of each joint over its speed, with its band."""
    if not curves:
        return [Text("The model has no friction, or the joints moved too little to draw it.")]
    signs = Sign(BLUE, "band"), Sign(BLUE), Sign(ORANGE, "circle")
    charts, rows = [], []
    for c in curves:
        band = np.stack([c.model - c.half_width, c.model + c.half_width])
        shown = [
            Curve("90 % interval", signs[0], band),
            Curve("model", signs[1], c.model),
            Curve("measured", signs[2], c.measured),
        ]
        name = labels[c.joint]
        panel = Panel("friction torque [N·m]", shown)
        charts.append(line_chart(name, ("speed [rad/s]", c.speed), [panel], joint=name))
        cells = np.stack([c.speed, c.model, c.half_width, c.measured], axis=1)[::_EVERY]
        rows += [[name, *map(number, cell)] for cell in cells.tolist() if cell[0]]
    heads = ("speed [rad/s]", "model [N·m]", "± (90 %) [N·m]", "measured [N·m]")
    caption = (
        "Viscous and Coulomb friction of the model with the 90 % interval of its parameters, beside"
        " the measured torque minus everything else in the model, averaged over equally many"
        " samples. Points that bend away from the line hint at an effect that the model lacks."
    )
    table = Table("Friction over speed.", [Column("joint", "words"), *map(Column, heads)], rows)
    return [Figure("Friction of each joint", caption, charts, table)]


def correlation_blocks(content: Content, correlated: NDArray[np.floating] | None) -> list[Block]:
    """Which parameters stand in for each other."""
    names = [p["name"] for p in content["base_parameters"]]
    if correlated is None or len(names) < 2:
        return []
    edges = np.arange(len(names) + 1) - 0.5
    below = np.where(np.tri(len(names), k=-1, dtype=bool), correlated, np.nan)
    chart = map_chart(
        "Correlation of the base parameters", ("", ""), (edges, edges), below.T, 1.0, names
    )
    i, j = np.nonzero(np.isfinite(below))
    order = np.argsort(-np.abs(below[i, j]))[:_STRONGEST]
    rows = [[names[i[k]], names[j[k]], number(float(below[i[k], j[k]]), 2)] for k in order]
    columns = [Column("parameter", "words"), Column("parameter", "words"), Column("correlation")]
    caption = (
        "Blue: an error that makes one parameter too large makes the other too large as well."
        " Orange: the other too small. Strong colours far from the diagonal are parameters that"
        " this motion can hardly tell apart."
    )
    table = Table("The strongest correlations (OLS).", columns, rows)
    return [Figure("Correlation of the base parameters", caption, [chart], table)]


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
        "Base parameters are possible if some arm has them whose masses are positive, whose inertia"
        " tensors are those of real bodies, and whose friction opposes motion. The mass matrix is"
        " tested at random postures over the whole joint range."
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
        sentences.append(f"Held still, so nothing is known about them: {listed(held)}.")
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
