"""The work of `ident gap`, from files to files."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import read_experiment, trusting
from ident.gap.regression.feasible_fit import FeasibleModel, feasible_fit
from ident.gap.results.error_by_term import steps
from ident.gap.results.forward_simulation import Forward, forward, rms
from ident.gap.results.full_model import model_with
from ident.gap.results.held_out_error import BeforeAfter, held_out, sides, where
from ident.gap.results.minimum_detectable import minimum_detectable
from ident.gap.results.outcome import Options, Search
from ident.gap.search import search
from ident.gap.selection.estimates import FinalEstimates, final_estimates
from ident.model.model_file import write_model
from ident.recordings.loading import Reading
from ident.report.gap_figures import maps, motion_blocks, torque_blocks
from ident.report.gap_page import GapReport, gap_page, verdict_sentences
from ident.report.page import render
from ident.report.words import joint_labels
from ident.workflows.gap_json import (
    effects_content,
    forward_content,
    held_out_content,
    steps_content,
    unexplained_content,
    visibility_content,
    where_content,
)
from ident.workflows.provenance import provenance
from ident.workflows.run_json import as_json, whole_folder

Tell = Callable[[str], None]

_MOST_JOINTS = 3


@dataclass(frozen=True)
class _Outcome:
    """A search with everything that is told of it.

    Attributes:
        found: the search.
        final: values of the effects on all data.
        whole: the possible arm with all effects, on all data.
        both: residuals before and after, held-out ones honest.
        before, after: simulations of the recordings.
    """

    found: Search
    final: FinalEstimates
    whole: FeasibleModel
    both: BeforeAfter
    before: list[Forward]
    after: list[Forward]


def gap_logs(
    paths: Sequence[Path],
    known: tuple[Path | None, Path | None],
    out: Path,
    reading: Reading,
    options: Options,
    tell: Tell,
) -> tuple[str, list[str]]:
    """Search and write; gives the content of `gap.json` and the verdict in sentences.

    Args:
        paths: the logs.
        known: file that describes the arm, None: what travels inside the logs; and a model that
            was trusted before, None: the links are fitted to the logs.
        out: folder for the results.
        reading: topics and torque to read.
        options: of the search.
        tell: hears of the progress.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    robot, trusted = known
    source = read_experiment(paths, robot, reading)
    if trusted is not None:
        source = trusting(source, trusted)
    outcome = _outcome(search(source, options, tell), tell)
    content = _content(outcome) | {"provenance": provenance(source.arm, paths)}
    tell("writing the report")
    report = _report(outcome, content)
    content["seconds"] = time.perf_counter() - start
    model = model_with(
        source,
        outcome.found.rows.windows,
        outcome.whole,
        outcome.final.fit,
        outcome.final.hypotheses,
        outcome.found.end.model.slow,
    )
    with whole_folder(out, ("gap.json", "model.yaml", "report.html")) as folder:
        write_model(folder / "model.yaml", model)
        (folder / "report.html").write_text(render(gap_page(report)), encoding="utf-8")
        text = as_json(content)
        (folder / "gap.json").write_text(text, encoding="utf-8")
    return text, verdict_sentences(report)


def _outcome(found: Search, tell: Tell) -> _Outcome:
    tell("fitting all data")
    final = final_estimates(found.rows, found.end, found.verdict.found)
    b = len(found.rows.kept)
    before, after = (feasible_fit(found.source, p.fit, b) for p in (found.start, found.end))
    whole = feasible_fit(found.source, final.fit, b) if found.end.accepted else after
    tell("simulating the recordings")
    old = forward(found.source, before, ())
    new = forward(found.source, whole, final.hypotheses) if found.end.accepted else old
    return _Outcome(found, final, whole, sides(found, before.x, after.x), old, new)


def _content(outcome: _Outcome) -> dict[str, Any]:
    """The content of `gap.json`, but for provenance and time."""
    found, both = outcome.found, outcome.both
    source = found.source
    unseen, sizes = visibility_content(minimum_detectable(found))
    errors = (rms(runs, source.moving) for runs in (outcome.before, outcome.after))
    return {
        "verdict": str(found.verdict.kind),
        "effects": effects_content(found, outcome.final),
        "where": where_content(where(found, both)),
        "not_observable": unseen,
        "held_out": held_out_content(held_out(found, both)),
        "steps": steps_content(steps(found)),
        "forward_simulation": forward_content(*errors),
        "minimum_detectable": sizes,
        "unexplained": unexplained_content(found),
        "arm": source.arm.name,
        "joints": list(source.arm.robot.joint_names),
    }


def _report(outcome: _Outcome, content: dict[str, Any]) -> GapReport:
    found, both = outcome.found, outcome.both
    names = found.source.arm.robot.joint_names
    labels = joint_labels(names)
    joints = list(dict.fromkeys(w["joint"] - 1 for w in content["where"]))
    joints = joints[:_MOST_JOINTS] or np.flatnonzero(found.source.moving).tolist()
    effects = catalogue()
    return GapReport(
        content,
        found.source.arm.name,
        names,
        {name: e.title for name, e in effects.items()},
        maps(found, both, joints),
        torque_blocks(found, both, joints, labels),
        motion_blocks(outcome.before, outcome.after, joints, labels),
        {name: (e.signature, e.experiment) for name, e in effects.items()},
    )
