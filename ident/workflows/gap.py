"""The work of `ident gap`, from files to files."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ident.checks.examine import OF_LOADS, examine
from ident.checks.recorder_faults.delay import late_by_fit
from ident.checks.remark import Grade, RefusedError, Remark, no_fit, undetermined
from ident.checks.settings import DEFAULT
from ident.checks.signs import DRIVING_FRICTION
from ident.checks.torque import explained_after_all
from ident.effects.bound_effects import load_model
from ident.effects.simulated_model import with_loads
from ident.effects.torque_delay import EFFECT as TORQUE_DELAY
from ident.estimation.regression_data import RegressionData
from ident.gap.data.broken_time import unbroken
from ident.gap.data.experiment import Experiment, read_experiment, with_reference_model
from ident.gap.naming.dependence import dependences
from ident.gap.options import Options
from ident.gap.results.error_by_term import error_by_term
from ident.gap.results.forward_simulation import rms
from ident.gap.results.held_out_error import gap_location, held_out
from ident.gap.results.minimum_detectable import minimum_detectable
from ident.gap.search import search
from ident.identification.term_selection import ON_DEMAND
from ident.identification.torque_delay import delay
from ident.identification.validation import arm_of, on_time, with_delay
from ident.model.identified_model import Model
from ident.recordings.loading import Reading
from ident.report.gap.figures import (
    effect_figures,
    left_figure,
    motion_figure,
    reversals,
    sizes_of,
    torque_figure,
)
from ident.report.gap.page import gap_page
from ident.report.gap.report import GapReport
from ident.report.gap.words import verdict_sentences
from ident.report.page import render
from ident.workflows.agreement import contradictions
from ident.workflows.gap_friction import friction_content
from ident.workflows.gap_json import (
    effects_content,
    forward_content,
    held_out_content,
    in_own_units,
    refused_gap,
    steps_content,
    suspected_content,
    trust_content,
    unexplained_content,
    visibility_content,
    where_content,
)
from ident.workflows.gap_outcome import (
    Outcome,
    beside_run,
    counted,
    outcome_of,
    written_model,
)
from ident.workflows.gap_terms import terms_content
from ident.workflows.model_errors import errors_on
from ident.workflows.run import cutoff_chosen
from ident.workflows.work import Search, provenance, recordings_content, write_refusal
from wamctl.arm.errors import DataError
from wamctl.arm.joint_labels import joint_labels

Tell = Callable[[str], None]

_MOST_JOINTS = 3


@dataclass(frozen=True)
class Gap(Search):
    """A search, and everything that is written about it.

    Attributes:
        report: the content of the page.
    """

    model: Model
    report: GapReport

    @property
    def sentences(self) -> list[str]:
        """The verdict in sentences."""
        return verdict_sentences(self.report)

    def page(self) -> str:
        """The report, one HTML page."""
        return render(gap_page(self.report))


def gap_logs(
    paths: Sequence[Path],
    known: tuple[Path | None, Path | None],
    out: Path,
    reading: Reading,
    options: Options,
    tell: Tell,
    **settings: Any,
) -> tuple[str, list[str]]:
    """Search and write; gives the content of `gap.json` and the verdict in sentences.

    Args:
        paths: the logs.
        known: file that describes the arm, None: the one attached to the logs, or the reference
            model's; and a reference model, None: the links are fitted to the logs.
        out: folder for the results.
        reading: topics and torque to read.
        options: of the search.
        tell: is told the progress.
        settings: fields of the identification section that differ from the arm's.

    Raises:
        RefusedError: nothing may be said of them; `gap.json` and the report say why.
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    robot, trusted = known
    model = None if trusted is None else load_model(trusted)
    known_arm = None if model is None else arm_of(model)
    source = read_experiment(paths, robot, reading, options.settings.long_logs, known_arm)
    source = replace(source, arm=source.arm.with_settings(**settings))
    if model is not None:
        source = with_reference_model(source, model, str(trusted))
    try:
        done = gap_of(source, options, tell, paths)
    except RefusedError as refusal:
        content = refused_gap(source, refusal, time.perf_counter() - start)
        write_refusal(out, "gap", refusal, content, source.arm.name)
        raise
    done.content["seconds"] = time.perf_counter() - start
    return done.write(out), done.sentences


@threadpool_limits.wrap(limits=1)  # small matrices: more threads only wait for each other
def gap_of(source: Experiment, options: Options, tell: Tell, paths: Sequence[Path] = ()) -> Gap:
    """Search recordings that have been read; nothing is written.

    Args:
        source: the recordings and their arm.
        options: of the search.
        tell: is told the progress.
        paths: files of the recordings, where there are any.

    Raises:
        RefusedError: recordings or an arm of which nothing may be said.
    """
    start, read = time.perf_counter(), source
    tell("checking the recordings")
    examined = examine(source.arm, source.datasets)
    remarks = (*source.remarks, *examined.remarks)
    if examined.verdict is Grade.REFUSED:
        raise RefusedError(remarks)
    possible = not any(r.code == DRIVING_FRICTION for r in examined.remarks)
    cut = [unbroken(data, options.settings.broken_time) for data in examined.data]
    remarks = (*remarks, *(r for _, more in cut for r in more))
    source = replace(source, datasets=tuple(data for data, _ in cut), is_possible=possible)
    if examined.gains is not None:
        known = source.arm.with_settings(gains_nm_per_a=examined.gains.value.tolist())
        source = replace(source, arm=known)
    delay_s, timed = source.arm.settings.delay_s, [on_time(d, source.arm) for d in source.datasets]
    source = replace(source, datasets=tuple(d for d, _ in timed), arm=timed[0][1])
    chosen, notes = cutoff_chosen(source.datasets, source.arm)
    source, remarks = replace(source, arm=chosen), (*remarks, *notes)
    asked = source.arm.settings
    if "terms" in asked.model_fields_set and ON_DEMAND not in asked.terms:
        options = replace(options, terms_on_demand=False)
    outcome = searched(source, options, remarks, tell)
    tell("fitting the arm beside the effects")
    outcome, written, withheld = beside_run(*written_model(outcome, tell), tell)
    model, against, disagree = written.model, [], []
    if written.evidence is not None:
        against, disagree = contradictions(written.evidence, searched=True)
    if source.reference_model is not None:
        remarks = without_load_doubts(remarks, read, model)
    errors = errors_on(model, counted(source))
    if notes and errors:
        left = max(log["relative_error_percent"] for log in errors) / 100
        remarks = explained_after_all(remarks, left, DEFAULT)
    told = (*remarks, *outcome.remarks, *written.failed, *against, *withheld)
    told = (*told, *late_beside(written.evidence, model, told, delay_s or 0.0))
    content = _content(outcome) | trust_content(told)
    content["terms"] = in_own_units(
        terms_content(written, outcome.places), source.arm.robot.sliding.tolist()
    )
    content |= {"recordings_disagree": disagree} if disagree else {}
    content |= friction_content(model, source.reference_model, counted(source))
    content["provenance"] = provenance(source.arm, paths)
    tell("preparing the report")
    report = _report(outcome, content)
    content["seconds"] = time.perf_counter() - start
    content["errors"] = errors
    return Gap(with_delay(model, delay_s), content, report)


def late_beside(
    evidence: RegressionData | None, model: Model, told: Sequence[Remark], known_s: float = 0.0
) -> list[Remark]:
    """What is said of torque out of time that the fit leaves, unless it is told or named already.

    Args:
        evidence: what the arm was fitted to, without the effects.
        model: with what was named.
        told: what is said beside it.
        known_s: the delay that is set already.
    """
    named = any(effect.name == TORQUE_DELAY.id for effect in model.effects.records)
    if evidence is None or named or any(r.code == "late_torque" for r in told):
        return []
    remarks = []
    for log in evidence.logs:
        found = delay(log)
        value = f"{known_s + found.seconds:.2g}"
        advice = f"Set delay_s: {value} in the identification section of the arm's file."
        short = abs(found.seconds) < DEFAULT.late_by_fit_s  # a long one is that of a filter
        more = late_by_fit(found, log.data.name, DEFAULT)
        remarks += [replace(r, advice=advice) if short else r for r in more]
    return remarks


def without_load_doubts(
    remarks: Sequence[Remark], source: Experiment, model: Model
) -> list[Remark]:
    """What was said before the search, without what a load that it named explains.

    Args:
        remarks: of the recordings.
        source: they as they were read, before a unit was converted or currents became torque.
        model: with what was named.
    """
    if not any(r.code in OF_LOADS for r in remarks):
        return list(remarks)
    arm = with_loads(source.arm, model)
    if arm is source.arm:
        return list(remarks)
    examined = examine(arm, source.datasets)
    if examined.verdict is Grade.REFUSED:
        return list(remarks)
    left = {r.code for r in examined.remarks}
    return [r for r in remarks if r.code not in OF_LOADS or r.code in left]


def searched(
    source: Experiment, options: Options, remarks: Sequence[Remark], tell: Tell
) -> Outcome:
    """The search, and the fits with what it found.

    Raises:
        RefusedError: what stopped it, as a remark beside the others.
    """
    try:
        return outcome_of(search(source, options, tell), tell)
    except np.linalg.LinAlgError:
        stop = undetermined()
    except DataError as error:
        stop = no_fit(str(error))
    raise RefusedError((stop, *remarks))


def _content(outcome: Outcome) -> dict[str, Any]:
    """The content of `gap.json`, but for provenance and time."""
    found, both = outcome.found, outcome.both
    source = found.source
    asked = found.options.settings.naming
    leaning = dependences(found.rows, found.end, outcome.final, asked)
    unobservable, sizes = visibility_content(minimum_detectable(found))
    errors = (rms(runs, source.moving) for runs in (outcome.before, outcome.after))
    sliding = source.arm.robot.sliding.tolist()
    return {
        "verdict": str(found.verdict.kind),
        "effects": in_own_units(effects_content(found, outcome.final, leaning), sliding),
        "suspected": in_own_units(suspected_content(found, outcome.final), sliding),
        "where": where_content(gap_location(found, both), sliding),
        "not_observable": unobservable,
        "held_out": held_out_content(held_out(found, both)),
        "steps": steps_content(error_by_term(found)),
        "forward_simulation": forward_content(*errors),
        "minimum_detectable": sizes,
        "detectable_units": {name: unit for name, (_, unit) in sizes_of(found).items()},
        "unexplained": unexplained_content(found),
        "settings": found.options.content(),
        "arm": source.arm.name,
        "joints": list(source.arm.robot.joint_names),
        "logs": recordings_content(source.datasets),
    }


def _report(outcome: Outcome, content: dict[str, Any]) -> GapReport:
    found, both = outcome.found, outcome.both
    labels = joint_labels(found.source.arm.robot.joint_names)
    joints = list(dict.fromkeys(w["joint"] - 1 for w in content["where"]))
    joints = joints[:_MOST_JOINTS] or np.flatnonzero(found.source.moving).tolist()
    nameless = [u["joint"] - 1 for u in content["unexplained"]]
    curves, acts = effect_figures(found, both, labels)
    return GapReport(
        content,
        sizes_of(found),
        curves,
        reversals(both),
        left_figure(found, both, nameless, labels),
        torque_figure(found, both, joints, labels),
        motion_figure(outcome.before, outcome.after, joints, labels),
        acts,
    )
