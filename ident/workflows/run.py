"""The work of `ident run`, from files to files."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from threadpoolctl import threadpool_limits

from ident.checks.examine import examine
from ident.checks.known_load import KnownLoad
from ident.checks.recorder_faults.delay import late_by_fit
from ident.checks.remark import (
    Grade,
    RefusedError,
    Remark,
    no_fit,
    undetermined,
    verdict_content,
)
from ident.checks.settings import DEFAULT
from ident.checks.torque import (
    beyond_possible,
    explained_after_all,
    links_of_no_use,
    poorly_explained,
    poorly_predicted,
)
from ident.identification.cutoff_selection import with_best_cutoff
from ident.identification.identify import Identification, identify, model_of
from ident.identification.validation import on_time, with_delay
from ident.model.arm import TERM_NAMES, Arm
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset
from ident.recordings.errors import TooShortError
from ident.recordings.loading import Reading, read_for, read_logs
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.run_page import run_page, run_report
from ident.workflows.agreement import contradictions
from ident.workflows.model_errors import errors_of_fit, errors_on
from ident.workflows.run_json import (
    currents_content,
    run_content,
    torque_units,
    with_uncertain_gains,
)
from ident.workflows.work import Work, provenance, refused_run, write_refusal
from wamctl.arm.configuration.known_change import KnownChangeError, known_change
from wamctl.arm.errors import ConfigurationError, DataError

METHOD = "regression"


@dataclass(frozen=True)
class Run(Work):
    """An identification, and everything that is written about it.

    Attributes:
        found: the identification.
    """

    command: ClassVar[str] = "run"

    model: Model
    found: Identification

    def page(self) -> str:
        """The report, one HTML page."""
        return render(run_page(run_report(self.content, self.found)))


def run_logs(
    paths: Sequence[Path],
    robot: Path | None,
    out: Path,
    reading: Reading,
    tell: Tell = silent,
    effects: Path | None = None,
    load: str | None = None,
    further: Callable[["Run", Tell], "Run"] | None = None,
    **settings: Any,
) -> str:
    """Identify and write; gives the content of `run.json`.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        out: folder for the results.
        reading: topics and torque to read.
        tell: hears what is being done.
        effects: a `model.yaml` whose effects are taken off the torque first, and kept; its terms
            are taken where the arm's settings name none.
        load: a log of the arm with a known load, and the load: LOG=KG,X,Y,Z.
        further: what is made of the identification by regression; None: it is what is asked for.
        settings: fields of the identification section that differ from the arm's.

    Raises:
        RefusedError: no model may be drawn from them; `run.json` and the report say why.
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    arm, data = read_logs(paths, robot, reading)
    arm = arm.with_settings(**settings)
    known = None if effects is None else _known(effects, arm)
    if known is not None and "terms" not in arm.settings.model_fields_set:
        arm = arm.with_settings(terms=[n for n in TERM_NAMES if getattr(known.terms, n)])
    read = time.perf_counter() - start
    try:
        loaded = None if load is None else _loaded(arm, load, reading)
        done = run_data(arm, data, tell, known, paths, loaded)
        done = done if further is None else further(done, tell)
    except RefusedError as refusal:
        write_refusal(out, "run", refusal, refused_run(arm, data, refusal), arm.name)
        raise
    done.content["seconds"] = {"read": read} | done.content["seconds"]
    tell("writing the report")
    drawing = time.perf_counter()
    page = done.page()
    end = time.perf_counter()
    done.content["seconds"] |= {"report": end - drawing, "total": end - start}
    return done.write(out, page)


def _loaded(arm: Arm, text: str, reading: Reading) -> KnownLoad:
    """The recording with the known load.

    Raises:
        ConfigurationError: a text that names no log and load.
        UserError: a log that cannot be used.
    """
    path, _, size = text.rpartition("=")
    try:
        load = known_change(f"load={size}").load
    except KnownChangeError as error:
        wrong = f"{text!r} is not LOG=KG,X,Y,Z, such as loaded.mcap=2,0,0,0.1 ({error.why})"
        raise ConfigurationError("--load", [wrong]) from error
    return KnownLoad(read_for(arm, Path(path), reading), load)


@threadpool_limits.wrap(limits=1)  # small matrices: more threads only wait for each other
def run_data(
    arm: Arm,
    data: Sequence[Dataset],
    tell: Tell = silent,
    known: Model | None = None,
    paths: Sequence[Path] = (),
    load: KnownLoad | None = None,
) -> Run:
    """Identify an arm from recordings that have been read; nothing is written.

    Args:
        arm: robot and settings.
        data: the recordings, joints in the robot's order.
        tell: hears what is being done.
        known: a model whose effects are taken off the torque first, and kept.
        paths: files of the recordings, where there are any.
        load: a recording with a known load, which tells the gains of currents.

    Raises:
        RefusedError: recordings or an arm from which no model may be drawn.
        ConfigurationError: a known load for an arm whose efforts are no currents.
    """
    if load is not None and arm.settings.torque_unit != "A":
        wrong = "a known load tells gains of currents alone: set torque_unit=A, or leave it out"
        raise ConfigurationError("load", [wrong])
    tell("checking the recordings")
    examined = examine(arm if known is None else _loaded_by(known, arm), data, load=load)
    if examined.verdict is Grade.REFUSED:
        raise RefusedError(examined.remarks)
    data, gains = examined.data, examined.gains
    if gains is not None:
        arm = arm.with_settings(gains_nm_per_a=gains.value.tolist())
    arm, notes = cutoff_chosen(data, arm, tell)
    whole = data
    delay_s = arm.settings.delay_s
    if known is not None:
        whole, arms = zip(*(on_time(d, arm) for d in data), strict=True)
        data, arm = [_without(known, d) for d in whole], arms[0]
    remarks = (*examined.remarks, *notes)
    found = identified(data, arm, remarks, tell)
    fit_sd = found.sd
    found = found if gains is None else with_uncertain_gains(found, gains)
    note = found.estimates[found.chosen].note if found.chosen == "feasible" else ""
    if notes:
        left = found.held_out[found.chosen].errors.relative_percent / 100
        remarks = explained_after_all(remarks, left, DEFAULT)
    remarks = (*remarks, *([no_fit(note, Grade.DOUBTFUL)] if note else []))
    against, disagree = contradictions(found.evidence, found.delays, delay_s=delay_s)
    content = verdict_content((*remarks, *_poor(found, remarks), *against)) | {"method": METHOD}
    content |= run_content(found) | ({"recordings_disagree": disagree} if disagree else {})
    if gains is not None:
        content = currents_content(content, fit_sd, gains, found)
    content["provenance"] = provenance(arm, paths)
    model = model_of(found)
    if known is None:
        content["errors"] = errors_of_fit(found)
    else:
        model = replace(model, effects=known.effects)
        content["errors"] = errors_on(model, whole)
        model = with_delay(model, delay_s)
    return Run(model, content, found)


_TELLS_LINKS = {"cad_disagrees", "units", "no_inertials", "gravity_direction", "zero_pose"}
"""Remarks on why the URDF's links do not predict the torque."""


def _poor(found: Identification, told: Sequence[Remark]) -> list[Remark]:
    """What the model explains too little of, or out of time, unless a check has told that."""
    errors = found.held_out[found.chosen].errors
    shares = errors.relative_percent_by_joint / 100
    known = [j - 1 for r in told if r.code == "large_error" for j in r.joints]
    shares[known] = 0.0
    robot = found.evidence.arm.robot
    units = torque_units(robot)
    more = poorly_predicted(shares, errors.rms_by_joint, robot.joint_names, units, DEFAULT)
    if not any(r.code == "large_error" for r in (*told, *more)):
        more += poorly_explained(errors.relative_percent / 100, DEFAULT)
    if not any(r.code == "late_torque" for r in told):
        for one, log in zip(found.delays, found.evidence.logs, strict=True):
            more += late_by_fit(one, log.data.name, DEFAULT)
    if "cad" in found.held_out and not {r.code for r in told} & _TELLS_LINKS:
        more += links_of_no_use(found.held_out["cad"].errors.relative_percent / 100)
    if found.chosen == "feasible" and "ols" in found.held_out:
        error, least = (found.held_out[n].errors.relative_percent for n in ("feasible", "ols"))
        more += beyond_possible(error / 100, least / 100, partial(_error_turned, found), DEFAULT)
    return more


def _error_turned(found: Identification) -> float:
    """The relative error of a possible arm on held-out data whose torque is turned round."""
    arm = found.evidence.arm
    turned = [log.data.with_torque_times(-np.ones(arm.robot.dof)) for log in found.evidence.logs]
    try:
        other = identify(turned, arm)
    except (DataError, np.linalg.LinAlgError):
        return math.inf
    return other.held_out[other.chosen].errors.relative_percent / 100


def cutoff_chosen(
    data: Sequence[Dataset], arm: Arm, tell: Tell = silent
) -> tuple[Arm, tuple[Remark, ...]]:
    """The arm with a cut-off where the motion gives none, and what to say of it."""
    arm, choice = with_best_cutoff(data, arm, tell)
    if choice is None:
        return arm, ()
    return arm, (Remark("cutoff", (), choice.sentence, Grade.TRUSTWORTHY),)


def identified(
    data: Sequence[Dataset], arm: Arm, remarks: Sequence[Remark], tell: Tell
) -> Identification:
    """The identification.

    Raises:
        RefusedError: what stopped it, as a remark beside the others.
    """
    try:
        return identify(data, arm, tell)
    except TooShortError as error:
        stop = Remark("too_short", (), error.finding, Grade.REFUSED, error.advice)
    except DataError as error:
        stop = no_fit(str(error))
    except np.linalg.LinAlgError:
        stop = undetermined()
    raise RefusedError((stop, *remarks))


def _known(path: Path, arm: Arm) -> Model:
    """The model whose effects are taken off.

    Raises:
        DataError: it is another arm's.
    """
    from ident.effects.bound_effects import load_model  # effects load numba, half a second

    model = load_model(path)
    if model.robot.joint_names != arm.robot.joint_names:
        raise DataError(
            f"{path} is a model of {model.arm}, whose joints are not those of the recordings:"
            " its effects cannot be taken off here."
        )
    return model


def _loaded_by(model: Model, arm: Arm) -> Arm:
    """The arm with what a model's effects add to its links."""
    from ident.effects.simulated_model import with_loads  # effects load numba, half a second

    return with_loads(arm, model)


def _without(model: Model, data: Dataset) -> Dataset:
    """A recording without the torque of a model's effects, and with a remark that says so."""
    from ident.effects.compensation import without_effects  # effects load numba, half a second

    names = ", ".join(f"{e.name} {'-'.join(map(str, e.joints))}" for e in model.effects.records)
    fact = f"torque of {names or 'no effect'} taken off, as the model that was given has it"
    cleaned = without_effects(model, data)
    return replace(cleaned, facts=(*cleaned.facts, fact))
