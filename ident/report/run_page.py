"""The page of `ident run`: whether to trust the model, its errors, friction, and parameters."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import speaks_against_input
from ident.identification.identify import Identification
from ident.report.data_blocks import culling_blocks, motion_blocks
from ident.report.figures import Trace, error_figure, held_out_traces, torque_blocks
from ident.report.model_blocks import (
    correlation_blocks,
    feasibility_blocks,
    friction_blocks,
    gain_blocks,
    limit_blocks,
    parameter_blocks,
)
from ident.report.page import Block, Page, Section, Status, Step, Table, Text, Verdict, table_of
from ident.report.provenance_section import provenance_section
from ident.report.run_curves import FrictionCurve, correlation, friction_curves
from ident.report.words import (
    DASH,
    Content,
    estimator_text,
    input_words,
    known,
    least_squares_text,
    number,
    percent,
    plus_minus,
    setting,
    share,
    whole,
)
from wamctl.arm.joint_labels import joint_labels, joints_text, listed

_LARGE_PERCENT = 25.0  # of a joint's torque: an effect may be missing

_TRUST: dict[str, tuple[Status, str]] = {
    "trustworthy": ("good", "trustworthy"),
    "doubtful": ("warning", "doubtful"),
    "refused": ("bad", "not to be trusted"),
}


@dataclass(frozen=True)
class RunReport:
    """What the page is made of.

    Attributes:
        content: of `run.json`.
        traces: the recordings, predicted without having been seen.
        friction: of each joint, over speed.
        correlated: correlation of the base parameters, shape (b, b); None where unknown.
    """

    content: Content
    traces: tuple[Trace, ...]
    friction: tuple[FrictionCurve, ...] = ()
    correlated: NDArray[np.floating] | None = None

    @property
    def chosen(self) -> str:
        """The estimator whose parameters are the model."""
        return self.content["estimator"]

    @property
    def held_out(self) -> dict[str, Any]:
        """Errors on data that was not fitted, by estimator."""
        return {name: e["held_out"] for name, e in self.content["estimators"].items()}

    @property
    def labels(self) -> list[str]:
        """The joints in print."""
        return joint_labels(self.content["joints"])


def run_report(content: Content, found: Identification) -> RunReport:
    """What the page of an identification is made of.

    Args:
        content: of `run.json`.
        found: the identification behind it.
    """
    correlated = correlation(found)
    friction = friction_curves(found, correlated)
    return RunReport(content, held_out_traces(found), friction, correlated)


def run_page(report: RunReport) -> Page:
    """The page of an identification."""
    content = report.content
    return Page(
        command="ident run",
        title=f"{content['arm']}: identified model",
        verdict=_verdict(report),
        figures=_figures(report),
        sections=[
            Section("How well it predicts", _prediction(report)),
            *([Section("Gains of the drives", gain_blocks(content))] if "gains" in content else []),
            Section("Measured and predicted torque", _torque(report)),
            Section("Friction over speed", _friction(report)),
            Section("Base parameters", parameter_blocks(content)),
            Section("Can such an arm exist?", feasibility_blocks(content)),
            Section(
                "What the data do not tell",
                [*limit_blocks(content), *correlation_blocks(content, report.correlated)],
            ),
            Section("Slow samples", culling_blocks(content)),
            Section("Motion and conditioning", motion_blocks(content)),
            provenance_section(content),
        ],
        steps=_steps(content),
    )


def _friction(report: RunReport) -> list[Block]:
    return friction_blocks(report.friction, report.labels, report.content["torque_units"])


def asks_for_gap(content: Content) -> bool:
    """Whether to ask what the model lacks, before it is tested on other recordings."""
    errors = [log["relative_error_percent_by_joint"] for log in content.get("errors", ())]
    large = max((x or 0.0 for joints in errors for x in joints), default=0.0) > _LARGE_PERCENT
    return large or content.get("verdict", "trustworthy") != "trustworthy"


def _steps(content: Content) -> list[Step]:
    words = input_words(content)
    test = Step(
        "Test the model on a recording that it was not fitted on:",
        ["ident", "validate", "OTHER.mcap", "--model", "model.yaml"],
    )
    gap = Step("Ask which physical effect the model still lacks:", ["ident", "gap", *words])
    use = Step(
        "Use the arm in other programs:",
        ["ident", "export", "model.yaml", "--to", "urdf", "--out", "arm.urdf"],
    )
    mended = Step(
        "Follow the advice at the top of this page, then repeat the command:",
        ["ident", "run", *words],
    )
    if content.get("verdict") == "refused":
        return [mended]
    if speaks_against_input(content.get("remarks", ())):
        return [mended, gap, test, use]
    return [gap, test, use] if asks_for_gap(content) else [test, gap, use]


def _verdict(report: RunReport) -> Verdict:
    content, chosen = report.content, report.chosen
    estimators, tested = content["estimators"], report.held_out
    error = plus_minus(
        tested[chosen]["relative_error_percent"], tested[chosen]["relative_error_percent_sd"]
    )
    others = [
        f"{estimator_text(n)} {percent(tested[n]['relative_error_percent'])}"
        for n in ("cad", "ols")
        if n in tested and n != chosen
    ]
    possible = estimators[chosen]["feasible"]
    kind = "A physically possible model" if possible else "A model that no arm can have"
    sentence = (
        f"{kind}, which predicts torque it was not fitted on with an error of {error}\u202f%"
        f" ({', '.join(others)})."
    )
    remarks = [r["sentence"] for r in content.get("remarks", [])]
    more = [*remarks, _worst_joint(report), _ordinary(estimators), _uncertain(content)]
    word = "physically possible" if possible else "physically impossible"
    status, word = _TRUST.get(content.get("verdict", ""), ("good" if possible else "bad", word))
    return Verdict(status, word, sentence, [sentence for sentence in more if sentence])


def error_sentences(content: Content) -> list[str]:
    """How well the model predicts: over all joints, and from the best joint to the worst."""
    report = RunReport(content, ())
    return [s for s in (_verdict(report).sentence, _worst_joint(report)) if s]


def _worst_joint(report: RunReport) -> str:
    shares = report.held_out[report.chosen]["relative_error_percent_by_joint"]
    found = [(s, label) for s, label in zip(shares, report.labels, strict=True) if known(s)]
    if len(found) < 2:
        return ""
    worst, best = max(found), min(found)
    return (
        f"Joint by joint, the error lies between {percent(best[0], 2)} at {joints_text([best[1]])}"
        f" and {percent(worst[0], 2)} at {joints_text([worst[1]])}; a model that predicts no torque"
        " at all has 100\u202f%."
    )


def _ordinary(estimators: Content) -> str:
    if "ols" not in estimators:
        return ""
    ols = estimators["ols"]
    if ols["feasible"]:
        return "Ordinary least squares gives a physically possible arm here as well."
    reasons = []
    positive = ols["mass_matrix_positive_fraction"]
    if known(positive) and positive < 1:
        part = share(positive)
        reasons.append(f"its mass matrix is positive at {part} of random postures")
    if ols["negative"]:
        reasons.append(f"{listed(ols['negative'])} came out negative")
    if not reasons:
        reasons.append("no possible masses and inertias give its base parameters")
    return f"Ordinary least squares gives an arm that cannot exist: {', and '.join(reasons)}."


def _uncertain(content: Content) -> str:
    limits, total = content["not_identified"], len(content["base_parameters"])
    invisible, confused = len(limits["invisible"]), len(limits["hardly_told_apart"])
    sentence = f"All {total} base parameters can be told from zero"
    if invisible:
        sentence = f"Of {total} base parameters, {invisible} cannot be told from zero"
    if confused:
        sentence += f", and {confused} combination{'s' * (confused > 1)} of them hardly shows"
    return sentence + "."


def _figures(report: RunReport) -> list[tuple[str, str]]:
    content = report.content
    error = report.held_out[report.chosen]
    return [
        (percent(error["relative_error_percent"]), "torque error, data not fitted"),
        (number(content["condition_number"]), "condition number (small is good)"),
        (whole(content["rank"]), "base parameters"),
        (whole(content["samples"]), f"samples at {setting(content['sample_rate_hz'])}\u202fHz"),
        (share(content["culled_fraction"]), "of rows left out (culled): joint too slow"),
        (f"{setting(content['cutoff_hz'])}\u202fHz", "low-pass cut-off"),
    ]


_ESTIMATORS = {
    "cad": "CAD: the masses and inertias of the arm's own file, before any fit.",
    "ols": "OLS: ordinary least squares.",
    "wls": "Weighted LS: each sample counts by how well its torque is known.",
    "feasible": "Feasible: the same among the arms that can physically exist.",
}
"""What an estimator is; those of other names explain themselves."""


def _prediction(report: RunReport) -> list[Block]:
    title = "Error on data that was not fitted, by joint and estimator"
    meanings = _ESTIMATORS | {"ols": least_squares_text(report.content)}
    return [
        Text(
            "Every recording is cut into short stretches. Each one is predicted by a model that was"
            " fitted without it, so these are errors on unseen motion of the same kind. "
            + " ".join(text for name, text in meanings.items() if name in report.held_out)
        ),
        error_figure(
            report.labels, report.held_out, report.chosen, report.content["torque_units"], title
        ),
        _fit_table(report.content["estimators"], report.chosen),
    ]


def _fit_table(estimators: Content, chosen: str) -> Table:
    cells: dict[str, Callable[[tuple[str, Content]], str]] = {
        "estimator": lambda e: estimator_text(e[0]),
        "not fitted [%]": lambda e: plus_minus(
            e[1]["held_out"]["relative_error_percent"],
            e[1]["held_out"]["relative_error_percent_sd"],
        ),
        "fitted [%]": lambda e: number(e[1]["relative_error_percent"]),
        "fitted, unfiltered torque [%]": lambda e: number(
            e[1]["raw_torque"]["relative_error_percent"]
        ),
        "mean squared residual [N²·m²]": lambda e: number(e[1]["mse"]),
    }
    if any("note" in e for e in estimators.values()):
        cells["remark"] = lambda e: e[1].get("note", DASH)
    place = list(estimators).index(chosen)
    caption = "Error over all joints (± standard error). Bold: the estimator that made the model."
    return table_of(caption, estimators.items(), cells, strong={place})


def _torque(report: RunReport) -> list[Block]:
    return torque_blocks(
        report.traces,
        report.labels,
        report.content["torque_units"],
        [report.held_out[report.chosen]],
        "Measured torque, and the prediction of a fit that has not seen that stretch.",
    )
