"""Blocks of the run page on the model: friction, Table I, feasibility, and what is not known."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ident.report.charts import Curve, Panel, line_chart, map_chart
from ident.report.page import Block, Figure, Points, Table, Text, table_of
from ident.report.run_curves import FrictionCurve
from ident.report.style import BLUE, ORANGE, Sign
from ident.report.words import (
    DASH,
    Content,
    decimals_of,
    estimator_text,
    fixed,
    joint_units,
    known,
    least_squares_text,
    number,
    plus_minus,
    share,
    unit_text,
)
from wamctl.arm.joint_labels import joint_labels, listed

_SEVERAL = 12
_EVERY = 4  # so many points of a friction curve make one row of its table
_STRONGEST = 20  # correlations in the table


def parameter_blocks(content: Content) -> list[Block]:
    """Table I."""
    chosen = content["estimator"]
    invisible = set(content["not_identified"]["invisible"])
    cells: dict[str, Callable[[Content], str]] = {
        "parameter": lambda p: p["name"],
        "CAD": lambda p: fixed(p["cad"], _places(p)),
        "OLS ± standard error": lambda p: plus_minus(p["ols"], p["sd"]),
        estimator_text(chosen): lambda p: fixed(p[chosen], _places(p)),
        "unit": lambda p: unit_text(p["unit"]),
    }
    if not any(known(p["cad"]) for p in content["base_parameters"]):
        del cells["CAD"]
    caption = (
        "The base parameters (the paper's Table I): only these combinations of the links' masses,"
        " centres of mass, and inertias affect the torque. CAD: value by the arm's own file."
        f" {least_squares_text(content)} Grey: OLS cannot tell the value from zero (90 % interval)."
    )
    parameters = content["base_parameters"]
    pale = {i for i, p in enumerate(parameters) if p["name"] in invisible}
    return [table_of(caption, parameters, cells, pale=pale)]


def _places(parameter: Content) -> int:
    """Decimals of a parameter's values."""
    return min(decimals_of(parameter["sd"]), 6)


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
    cells: dict[str, Callable[[Content], str]] = {
        "joint": lambda g: names[g["joint"] - 1],
        "gain [N·m/A]": lambda g: plus_minus(g["nm_per_ampere"], g["sd"]),
        "known from": lambda g: basis[g["from"]],
    }
    caption = (
        "Torque per ampere, ± standard error. The arm's parameters in N m, kg m or kg m² hold up to"
        " these; run.json holds the base parameters in ampere too, which do not depend on them."
    )
    return [table_of(caption, content["gains"], cells)]


def friction_blocks(
    curves: Sequence[FrictionCurve], labels: Sequence[str], units: Sequence[str]
) -> list[Block]:
    """Friction of each joint over its speed, with its band; units are those of the torque."""
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
        name, torque, speed = labels[c.joint], *joint_units(units[c.joint])
        panel = Panel(f"friction [{torque}]", shown)
        charts.append(line_chart(name, (f"speed [{speed}]", c.speed), [panel], joint=name))
        cells = np.stack([c.speed, c.model, c.half_width, c.measured], axis=1)[::_EVERY]
        own = f"{speed}, {torque}"
        rows += [[name, own, *map(number, cell)] for cell in cells.tolist() if cell[0]]
    heads = ("joint", "units", "speed", "model", "± (90 %)", "measured")
    caption = (
        "Viscous and Coulomb friction of the model with the 90 % interval of its parameters, beside"
        " the measured torque minus everything else in the model, averaged over equally many"
        " samples. Points that bend away from the line hint at an effect that the model lacks."
    )
    table = Table("Friction over speed.", heads, rows)
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
    caption = (
        "Blue: an error that makes one parameter too large makes the other too large as well."
        " Orange: the other too small. Strong colours far from the diagonal are parameters that"
        " this motion can hardly tell apart."
    )
    table = Table(
        "The strongest correlations (OLS).", ("parameter", "parameter", "correlation"), rows
    )
    return [Figure("Correlation of the base parameters", caption, [chart], table)]


def feasibility_blocks(content: Content) -> list[Block]:
    """Which estimates an arm could have, and what holds the chosen one."""
    estimators = content["estimators"]
    cells: dict[str, Callable[[tuple[str, Content]], str]] = {
        "estimator": lambda e: estimator_text(e[0]),
        "possible": lambda e: "yes" if e[1]["feasible"] else "no",
        "mass matrix positive at": lambda e: share(e[1]["mass_matrix_positive_fraction"]),
        "smallest pseudo-inertia eigenvalue [SI]": lambda e: number(
            e[1]["min_pseudo_inertia_eigenvalue"], 2
        ),
        "negative friction": lambda e: listed(e[1]["negative"]) or DASH,
    }
    caption = (
        "Base parameters are possible if some arm has them whose masses are positive, whose inertia"
        " tensors are those of real bodies, and whose friction opposes motion. The mass matrix is"
        " tested at random postures over the whole joint range."
    )
    place = list(estimators).index(content["estimator"])
    return [
        table_of(caption, estimators.items(), cells, strong={place}),
        *_constraints(content["active_constraints"], joint_labels(content["joints"])),
    ]


def _constraints(active: Sequence[Content], labels: Sequence[str]) -> list[Block]:
    if not active:
        return [Text("No constraint holds the solution: the data alone gave a possible arm.")]
    cells: dict[str, Callable[[Content], str]] = {
        "link or joint": lambda a: ["whole arm", *labels][a["joint"]],
        "constraint": lambda a: a["constraint"].replace(">=", "≥").replace("<=", "≤"),
        "where it is tight": lambda a: a.get("direction", DASH),
        "multiplier": lambda a: number(a["multiplier"], 2),
    }
    caption = (
        "Constraints that hold the solution, the strongest first: here the data alone would have"
        " left what is possible. The multiplier says how much the squared error [N²·m²] would fall"
        " per unit by which the bound is lowered (SI unit for friction, the link's own size for its"
        " matrix). A large one points at an effect that the model lacks, or at noise."
    )
    return [table_of(caption, active, cells)]


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
    reason = "not clear enough"
    if trial.get("contradicted"):
        reason = "with it whole parts of the motion predict each other worse"
    verdict = "in the model" if trial["taken"] else f"{reason}, so it is not in the model"
    return (
        f"The term {name} takes {gain} percentage points (± standard error) off the error on data"
        f" that was not fitted: {verdict}."
    )


def _several(names: Sequence[str]) -> str:
    shown = "; ".join(names[:_SEVERAL])
    rest = len(names) - _SEVERAL
    return f"{shown}; and {rest} more" if rest > 0 else shown
