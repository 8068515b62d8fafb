"""What is written where the checks refuse: the reasons, and no model."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ident.checks.remark import RefusedError, gravest_first, verdict_content
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.report.page import Page, Verdict, render
from ident.workflows.work import write_results

_MODEL = "model.yaml"


def refused_run(arm: Arm, data: Sequence[Dataset], refusal: RefusedError) -> dict[str, Any]:
    """The content of `run.json` without an identification."""
    return verdict_content(refusal.remarks) | {
        "method": "regression",
        "arm": arm.name,
        "samples": sum(d.samples for d in data),
        "joints": list(arm.robot.joint_names),
        "sample_rate_hz": data[0].rate_hz,
        "logs": [{"name": d.name, "samples": d.samples, "remarks": list(d.facts)} for d in data],
    }


def write_refusal(
    out: Path, command: str, refusal: RefusedError, content: dict[str, Any], arm: str
) -> None:
    """Write the result file and a page with the reasons; a model of an earlier run goes.

    Args:
        out: folder for the results.
        command: `run`, `validate`, or `gap`; also the name of the result file.
        refusal: the reasons.
        content: of the result file.
        arm: its name.

    Raises:
        DataError: the folder cannot be written.
    """
    first, *others = (r.sentence for r in gravest_first(refusal.remarks))
    verdict = Verdict("bad", "refused", first, others)
    page = Page(f"ident {command}", f"{arm}: no result", verdict, [], [])
    write_results(out, command, content, render(page))
    if command != "validate":
        (out / _MODEL).unlink(missing_ok=True)
