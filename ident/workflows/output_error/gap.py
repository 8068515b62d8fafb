"""The work of `ident gap --method simulation`, from files to files."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ident.checks.remark import Remark, verdict_content
from ident.model.arm import Arm
from ident.output_error.identify import model_of
from ident.output_error.judging import rms
from ident.output_error.missing.search import search
from ident.output_error.missing.verdict import Outcome, outcome
from ident.output_error.prepared import Prepared, prepared, searched
from ident.output_error.recordings import GLANCED_S, settled
from ident.output_error.search.exchanged import exchanged_joints
from ident.output_error.search.late_start import begun_with_delay, stamped_late
from ident.output_error.search.settings import SearchSettings
from ident.output_error.servo_model import ServoModel
from ident.output_error.setup import MotionSegment
from ident.output_error.zero_poses import turned_zeros
from ident.recordings.loading import Reading
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.servos.gap_page import ServoGap, servo_gap_page, verdict_sentences
from ident.report.servos.run_page import ServoTrace
from ident.workflows.output_error.commands import (
    command_remarks,
    early_remarks,
    order_remarks,
    turned_remarks,
)
from ident.workflows.output_error.following import fit_remarks
from ident.workflows.output_error.gap_json import gap_content
from ident.workflows.output_error.logs import read_commanded, read_remarks
from ident.workflows.work import Search, provenance


@dataclass(frozen=True)
class GapOfServos(Search):
    """A search by simulation, and everything that is written about it.

    Attributes:
        begun: arm and recordings.
        outcome: the search with its verdict.
    """

    model: ServoModel
    begun: Prepared
    outcome: Outcome

    @property
    def report(self) -> ServoGap:
        """What the page is made of."""
        setup, done = self.begun.setup, self.outcome
        before = setup.replay(done.before.settings)
        after = setup.replay(done.after.settings) if done.effects else before
        pairs = [
            tuple(ServoTrace.of(s, q) for s, q in zip(setup.segments, made, strict=True))
            for made in (before, after)
        ]
        return ServoGap(self.content, *pairs)

    @property
    def sentences(self) -> list[str]:
        """The verdict in sentences."""
        return verdict_sentences(self.report)

    def page(self) -> str:
        """The report, one HTML page."""
        return render(servo_gap_page(self.report))


def gap_simulation(
    paths: Sequence[Path],
    robot: Path | None,
    out: Path,
    reading: Reading,
    settings: SearchSettings,
    tell: Tell = silent,
    remarks: Sequence[Remark] = (),
) -> tuple[str, list[str]]:
    """Search and write; gives the content of `gap.json` and the verdict in sentences.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        out: folder for the results.
        reading: topics to read.
        settings: numbers that decide.
        tell: hears what is being done.
        remarks: what is known of the recordings already.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    arm, segments = read_commanded(paths, robot, reading)
    done = gap_of_servos(arm, segments, settings, tell, remarks, paths)
    done.content["seconds"] = time.perf_counter() - start
    tell("writing the report")
    return done.write(out), done.sentences


def gap_of_servos(
    arm: Arm,
    segments: Sequence[MotionSegment],
    settings: SearchSettings,
    tell: Tell = silent,
    remarks: Sequence[Remark] = (),
    paths: Sequence[Path] = (),
) -> GapOfServos:
    """Search commands and positions that have been read; nothing is written."""
    start = time.perf_counter()
    begun = prepared(arm, settled(segments))
    begun, base = begun_with_delay(begun, searched(begun.setup, GLANCED_S), settings)
    done = outcome(begun, search(begun, base, settings, tell), settings, tell)
    tell("what would have been seen")
    content = gap_content(begun, done, settings)
    early = stamped_late(begun, base, done.search.end, settings)
    told = [*read_remarks(arm, segments), *_of_commands(begun, done, early, settings)]
    trust = verdict_content([*remarks, *told])
    content |= {"trust": trust["verdict"], "remarks": trust["remarks"]}
    content["provenance"] = provenance(arm, paths)
    content["seconds"] = time.perf_counter() - start
    return GapOfServos(model_of(begun, done.after, done.known), content, begun, done)


def _of_commands(
    begun: Prepared, done: Outcome, early_s: float, settings: SearchSettings
) -> list[Remark]:
    """What is said of commands, and of joints that the model with the effects does not follow."""
    made = zip(begun.setup.segments, begun.setup.replay(done.after.settings), strict=True)
    traces = [ServoTrace.of(s, q) for s, q in made]
    names, fitted, left_out = (
        begun.arm.robot.joint_names,
        done.after.rms,
        rms(done.search.end.errors),
    )
    judged = fitted, left_out, traces, begun.setup.resolution, begun.moving, names
    turned = turned_zeros(begun.setup, done.after.settings, begun.moving)
    exchanged = exchanged_joints(begun, done.search.end, settings)
    return [
        *order_remarks(exchanged, names),
        *(command_remarks(traces, begun.moving, names) or early_remarks(early_s)),
        *turned_remarks(turned, names),
        *fit_remarks(*judged),
    ]
