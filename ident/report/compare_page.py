"""The page of `ident report compare`: two runs beside each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from ident.identification.standard_errors import QUANTILE_90
from ident.report.figures import ALL_JOINTS, all_and_each, row_figure
from ident.report.page import Block, Figure, Page, Section, Step, Table, Text, Verdict, table_of
from ident.report.style import AFTER, BEFORE, BLUE, Sign
from ident.report.words import (
    Content,
    estimator_text,
    input_words,
    known,
    number,
    percent,
    plus_minus,
    setting,
    share,
    unit_text,
    whole,
)
from wamctl.arm.joint_labels import joint_labels, listed

_CLEAR = 3.0  # combined standard errors
_MOST_NAMES = 8


@dataclass(frozen=True)
class Comparison:
    """Two runs of arms with the same joints.

    Attributes:
        names: of the runs; they differ.
        runs: the content of their `run.json`.
    """

    names: tuple[str, str]
    runs: tuple[Content, Content]


@dataclass(frozen=True)
class _Pair:
    """A base parameter that both runs have.

    Attributes:
        name: its name.
        unit: its unit.
        values: of both models.
        sds: their standard errors.
    """

    name: str
    unit: str
    values: tuple[float, float]
    sds: tuple[float, float]

    @property
    def apart(self) -> float:
        """Difference in combined standard errors."""
        return (self.values[1] - self.values[0]) / max(hypot(*self.sds), 1e-300)


def compare_page(both: Comparison) -> Page:
    """The page of a comparison."""
    pairs = _pairs(both)
    return Page(
        command="ident report compare",
        title=f"{both.names[0]} and {both.names[1]}",
        verdict=_verdict(both, pairs),
        figures=[
            (percent(_errors(run)["relative_error_percent"]), f"torque error, {name}")
            for name, run in zip(both.names, both.runs, strict=True)
        ],
        sections=[
            Section("Side by side", [_summary(both)]),
            Section("Error by joint", [_by_joint(both)]),
            Section("Base parameters", _parameters(both, pairs)),
        ],
        steps=[
            Step(
                "To ask which physical effect lies behind a difference, search the newer recording"
                " against the older model:",
                [
                    "ident",
                    "gap",
                    *input_words(both.runs[1]),
                    "--model",
                    f"{both.names[0]}/model.yaml",
                ],
            )
        ],
    )


def compare_content(both: Comparison) -> dict[str, Any]:
    """The same for programs: errors and verdicts of both runs, and the parameters of both."""
    return {
        "runs": [
            {
                "name": name,
                "verdict": run.get("verdict"),
                "relative_error_percent": _errors(run)["relative_error_percent"],
            }
            for name, run in zip(both.names, both.runs, strict=True)
        ],
        "base_parameters": [
            {"name": p.name, "unit": p.unit, "values": p.values, "sd": p.sds, "apart": p.apart}
            for p in _pairs(both)
        ],
    }


def _errors(run: Content) -> Content:
    return run["estimators"][run["estimator"]]["held_out"]


def _pairs(both: Comparison) -> list[_Pair]:
    tables = [
        {p["name"]: (p[run["estimator"]], p["sd"], p["unit"]) for p in run["base_parameters"]}
        for run in both.runs
    ]
    first, second = tables
    return [
        _Pair(name, unit, (value, second[name][0]), (sd, second[name][1]))
        for name, (value, sd, unit) in first.items()
        if name in second and all(map(known, (value, sd, *second[name][:2])))
    ]


def _clear(pairs: Sequence[_Pair]) -> list[_Pair]:
    found = [p for p in pairs if abs(p.apart) > _CLEAR]
    return sorted(found, key=lambda p: -abs(p.apart))


def _errors_apart(both: Comparison) -> str:
    """A sentence where the held-out errors differ clearly, although the parameters may not."""
    values = [_errors(run)["relative_error_percent"] for run in both.runs]
    sds = [_errors(run)["relative_error_percent_sd"] or 0.0 for run in both.runs]
    if abs(values[1] - values[0]) <= _CLEAR * hypot(*sds):
        return ""
    worse = both.names[int(values[1] > values[0])]
    return (
        f"The held-out errors do: {worse} predicts worse, and where a model misses an effect its"
        " intervals are wide."
    )


def _verdict(both: Comparison, pairs: Sequence[_Pair]) -> Verdict:
    found = _clear(pairs)
    errors = _errors_apart(both)
    limit = f"more than {setting(_CLEAR)} combined standard errors"
    if not found:
        sentence = f"No base parameter of the two runs differs by {limit}. {errors}".rstrip()
    else:
        sentence = (
            f"{len(found)} of {len(pairs)} base parameters differ by {limit}:"
            f" {listed([p.name for p in found[:_MOST_NAMES]])}"
            + (f", and {len(found) - _MOST_NAMES} more." if len(found) > _MOST_NAMES else ".")
        )
    texts = [
        f"{name}: held-out torque error "
        + plus_minus(
            _errors(run)["relative_error_percent"], _errors(run)["relative_error_percent_sd"]
        )
        + "\u202f%"
        + (f", {run['verdict']}." if "verdict" in run else ".")
        for name, run in zip(both.names, both.runs, strict=True)
    ]
    apart = bool(found or errors)
    return Verdict(
        "warning" if apart else "good", "different" if apart else "alike", sentence, texts
    )


def _summary(both: Comparison) -> Table:
    facts = {
        "verdict": lambda r: r.get("verdict", "–"),
        "remarks": lambda r: "; ".join(x["sentence"] for x in r.get("remarks", [])) or "–",
        "recordings": lambda r: ", ".join(log["name"] for log in r["logs"]),
        "samples": lambda r: whole(r["samples"]),
        "estimator": lambda r: estimator_text(r["estimator"]),
        "low-pass cut-off [Hz]": lambda r: setting(r["cutoff_hz"]),
        "rows left out as too slow": lambda r: share(r["culled_fraction"]),
        "base parameters": lambda r: whole(r["rank"]),
        "condition number": lambda r: number(r["condition_number"]),
        "held-out torque error [%]": lambda r: plus_minus(
            _errors(r)["relative_error_percent"], _errors(r)["relative_error_percent_sd"]
        ),
        "physically possible": lambda r: (
            "yes" if r["estimators"][r["estimator"]]["feasible"] else "no"
        ),
    }
    rows = [[text, *(of(run) for run in both.runs)] for text, of in facts.items()]
    return Table("What the two runs say.", ("result", *both.names), rows)


def _by_joint(both: Comparison) -> Figure:
    labels = joint_labels(both.runs[0]["joints"])
    values = {
        name: (sign, all_and_each(_errors(run)))
        for name, sign, run in zip(both.names, (BEFORE, AFTER), both.runs, strict=True)
    }
    return row_figure(
        "Error on data that was not fitted",
        "Equal steps along the axis are equal factors; further left is better.",
        "relative torque error [%]",
        [ALL_JOINTS, *labels],
        values,
        factors=True,
        joined=True,
    )


def _parameters(both: Comparison, pairs: Sequence[_Pair]) -> list[Block]:
    if not pairs:
        return [Text("The two runs have no base parameter in common.")]
    first, second = both.names
    marked = {i for i, p in enumerate(pairs) if abs(p.apart) > _CLEAR}
    table = table_of(
        "Parameters that both runs have, with 90 % intervals. Bold: clearly different.",
        pairs,
        {
            "parameter": lambda p: p.name,
            f"{first} ± 90 %": lambda p: plus_minus(p.values[0], QUANTILE_90 * p.sds[0]),
            f"{second} ± 90 %": lambda p: plus_minus(p.values[1], QUANTILE_90 * p.sds[1]),
            "difference / standard error": lambda p: number(p.apart, 2),
            "unit": lambda p: unit_text(p.unit),
        },
        strong=marked,
    )
    largest_first = sorted(pairs, key=lambda p: -abs(p.apart))
    figure = row_figure(
        "Differences",
        f"The largest first. Beyond ±{setting(_CLEAR)} a difference is hardly chance.",
        "difference, second minus first [combined standard errors]",
        [p.name for p in largest_first],
        {"difference": (Sign(BLUE, "bar"), [p.apart for p in largest_first])},
        head="parameter",
    )
    lonely = [
        f"{len(run['base_parameters']) - len(pairs)} only in {name}"
        for name, run in zip(both.names, both.runs, strict=True)
        if len(run["base_parameters"]) > len(pairs)
    ]
    more = [Text(f"Left out: {listed(lonely)}.")] if lonely else []
    return [table, *more, figure]
