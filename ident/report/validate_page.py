"""The page of `ident validate`: how well a model predicts recordings that it was not fitted on."""

from collections.abc import Sequence
from pathlib import Path

from ident.report.figures import Trace, error_figure, torque_blocks
from ident.report.page import Block, Page, Section, Step, Table, Text, Verdict, table_of, with_trust
from ident.report.provenance_section import provenance_section
from ident.report.words import (
    DASH,
    Content,
    input_words,
    known,
    number,
    percent,
    plus_minus,
    setting,
    whole,
)
from wamctl.arm.joint_labels import joint_labels, listed


def validate_page(content: Content, traces: Sequence[Trace]) -> Page:
    """The page of a validation.

    Args:
        content: of `validate.json`.
        traces: the recordings, predicted by the model.
    """
    return Page(
        command="ident validate",
        title=f"{content['arm']}: the model on other recordings",
        verdict=_verdict(content),
        figures=[
            (percent(log["relative_error_percent"]), Path(log["name"]).name)
            for log in content["logs"]
        ],
        sections=[
            Section("Recording by recording", [_summary(content)]),
            Section("Joint by joint", _by_joint(content)),
            Section("Measured and predicted torque", _torque(content, traces)),
            provenance_section(content),
        ],
        steps=_steps(content),
    )


def _steps(content: Content) -> list[Step]:
    words = input_words(content)
    return [
        Step(
            "If the error is larger than on the recordings of the fit, ask which effect is missing"
            " or has changed since:",
            ["ident", "gap", *words, "--model", content["model"]],
        ),
        Step("Or fit a model to these recordings:", ["ident", "run", *words]),
    ]


def _seen(content: Content) -> list[str]:
    """The recordings that the model was fitted on, by their names."""
    return [log["name"] for log in content["logs"] if log["name"] in content["fitted_on"]]


def seen_before(content: Content) -> str:
    """That the model was fitted on some of these recordings; empty where it was not."""
    seen = _seen(content)
    if not seen:
        return ""
    names = listed([Path(name).name for name in seen])
    return f"The model was fitted on {names}: its error there says little."


def _verdict(content: Content) -> Verdict:
    logs, chosen = content["logs"], content["estimator"]
    seen = _seen(content)
    errors = [
        f"{_with_sd(log['estimators'][chosen])}\u202f% on {Path(log['name']).name}" for log in logs
    ]
    one = len(logs) == 1
    count = "a recording" if one else f"{len(logs)} recordings"
    known_well = "" if seen else " that it was not fitted on"
    error = "an error" if one else "errors"
    sentence = (
        f"The model predicts the torque of {count}{known_well} with {error} of {listed(errors)}."
    )
    more = [_against(logs, chosen)]
    if seen:
        more.insert(0, seen_before(content))
    verdict = Verdict(
        "warning" if seen else "open",
        "seen before" if seen else "error on new data",
        sentence,
        [m for m in more if m],
    )
    return with_trust(verdict, content)


def _against(logs: Sequence[Content], chosen: str) -> str:
    """What OLS does on the same recordings, where it can be compared."""
    errors = [
        f"{Path(log['name']).name} {percent(log['estimators']['ols']['relative_error_percent'])}"
        for log in logs
        if "ols" in log["estimators"] and chosen != "ols"
    ]
    return f"Ordinary least squares from the same fit: {listed(errors)}." if errors else ""


def _with_sd(errors: Content) -> str:
    return plus_minus(errors["relative_error_percent"], errors["relative_error_percent_sd"])


def _summary(content: Content) -> Table:
    chosen = content["estimator"]
    return table_of(
        "Relative torque error of the model (± standard error). Errors of two models compare at one"
        " cut-off (--cutoff), or on unfiltered torque.",
        content["logs"],
        {
            "recording": lambda log: Path(log["name"]).name,
            "error [%]": lambda log: _with_sd(log["estimators"][chosen]),
            "on unfiltered torque [%]": lambda log: number(
                log["raw_torque"]["relative_error_percent"]
            ),
            "mean squared residual [N²·m²]": lambda log: number(log["mse"]),
            "samples": lambda log: whole(log["samples"]),
            "rate [Hz]": lambda log: setting(log["sample_rate_hz"]),
            "cut-off [Hz]": lambda log: setting(log["cutoff_hz"]),
            "torque": lambda log: log["torque"],
            "remarks": lambda log: "; ".join(log["remarks"]) or DASH,
        },
    )


def _by_joint(content: Content) -> list[Block]:
    labels, chosen = joint_labels(content["joints"]), content["estimator"]
    blocks: list[Block] = []
    for log in content["logs"]:
        title = f"{Path(log['name']).name}: error by joint and estimator"
        errors = {
            name: e for name, e in log["estimators"].items() if known(e["relative_error_percent"])
        }
        blocks.append(error_figure(labels, errors, chosen, content["torque_units"], title))
    return blocks or [Text("No recording.")]


def _torque(content: Content, traces: Sequence[Trace]) -> list[Block]:
    return torque_blocks(
        traces,
        joint_labels(content["joints"]),
        content["torque_units"],
        [log["estimators"][content["estimator"]] for log in content["logs"]],
        "Measured torque, and the prediction of the model.",
    )
