"""The work of `ident run`, from files to files."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ident.identification import identify, model_of
from ident.model_file import write_model
from ident.provenance import provenance
from ident.recordings import Reading, read_logs
from ident.report.page import render
from ident.report.run_page import RunReport, run_page
from ident.report.traces import held_out_traces
from ident.results import as_json, run_content, whole_folder
from ident.stages import Tell, silent


def run_logs(
    paths: Sequence[Path],
    robot: Path | None,
    out: Path,
    reading: Reading,
    tell: Tell = silent,
    **settings: Any,
) -> str:
    """Identify and write; gives the content of `run.json`.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        out: folder for the results.
        reading: topics and torque to read.
        tell: hears what is being done.
        settings: fields of the identification section that differ from the arm's.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    arm, data = read_logs(paths, robot, reading)
    arm = arm.with_settings(**settings)
    read = time.perf_counter() - start
    found = identify(data, arm, tell)
    content = run_content(found) | {"provenance": provenance(arm, paths)}
    content["seconds"] = {"read": read} | content["seconds"]
    tell("writing the report")
    drawing = time.perf_counter()
    page = render(run_page(RunReport(content, held_out_traces(found))))
    end = time.perf_counter()
    content["seconds"] |= {"report": end - drawing, "total": end - start}
    with whole_folder(out, ("run.json", "model.yaml", "report.html")) as folder:
        write_model(folder / "model.yaml", model_of(found))
        (folder / "report.html").write_text(page, encoding="utf-8")
        text = as_json(content)
        (folder / "run.json").write_text(text, encoding="utf-8")
    return text
