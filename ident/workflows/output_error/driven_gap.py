"""The work of `ident gap --method simulation` where the recordings hold torque."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.identification.by_simulation import BySimulation, by_simulation
from ident.identification.identify import model_of
from ident.output_error.driven.search import DrivenSearch, searched
from ident.output_error.driven.starts import LEAST_GAIN
from ident.output_error.driven.verdict import DrivenOutcome, Named, verdict
from ident.output_error.judging import rms
from ident.output_error.missing.kinds import KINDS, NOT_ASKED
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.search.settings import SearchSettings
from ident.recordings.loading import Reading, read_logs
from ident.regression.progress import Tell, silent
from ident.report.page import render
from ident.report.servos.gap_page import DrivenGapPage, servo_gap_page, verdict_sentences
from ident.report.servos.run_page import ServoTrace
from ident.signals.arrays import Array
from ident.workflows.output_error.gap_json import position_errors
from ident.workflows.run import Run, run_data
from ident.workflows.work import Search, provenance

_SHOWN = ("damping", "coulomb", "presliding", "turning_speed", "armature", "link_friction")
_SLOW = 0.1  # rad/s
_LEAST_SHARE = 0.05


@dataclass(frozen=True)
class DrivenGap(Search):
    """A search along recorded torque, and everything that is written about it.

    Attributes:
        simulated: the arm without effects.
        outcome: the search with its verdict.
    """

    simulated: BySimulation
    outcome: DrivenOutcome

    @property
    def report(self) -> DrivenGapPage:
        """What the page is made of."""
        sides = []
        for fit in (self.outcome.base, self.outcome.end):
            setup = replace(self.simulated.arm.setup, delta=fit.links)
            made = zip(setup.segments, setup.replay(fit.settings), strict=True)
            sides.append(tuple(ServoTrace(s.name, s.motion.t, s.q, s.q, q) for s, q in made))
        return DrivenGapPage(self.content, *sides)

    @property
    def sentences(self) -> list[str]:
        """The verdict in sentences."""
        return verdict_sentences(self.report)

    def page(self) -> str:
        """The report, one HTML page."""
        return render(servo_gap_page(self.report))


def gap_driven(
    paths: Sequence[Path],
    robot: Path | None,
    out: Path,
    reading: Reading,
    limits: SearchSettings,
    tell: Tell = silent,
    **settings: Any,
) -> tuple[str, list[str]]:
    """Search and write; gives the content of `gap.json` and the verdict in sentences.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: what travels inside the logs.
        out: folder for the results.
        reading: topics and torque to read.
        limits: numbers that decide.
        tell: hears what is being done.
        settings: fields of the identification section that differ from the arm's.

    Raises:
        UserError: what cannot be done; nothing is written then.
    """
    start = time.perf_counter()
    tell("reading")
    arm, data = read_logs(paths, robot, reading)
    arm = arm.with_settings(**settings)
    done = driven_gap(run_data(arm, data, tell, paths=paths), limits, tell)
    done.content["provenance"] = provenance(done.simulated.found.evidence.arm, paths)
    done.content["seconds"] = time.perf_counter() - start
    tell("writing the report")
    return done.write(out), done.sentences


def driven_gap(run: Run, limits: SearchSettings, tell: Tell = silent) -> DrivenGap:
    """Search recordings that regression has identified; nothing is written."""
    start = time.perf_counter()
    made = by_simulation(run.found, tell)
    moving = made.found.evidence.moving
    found = searched(made.arm, made.fit, moving, limits, tell)
    done = verdict(made.arm, found, moving, limits, tell)
    content = _content(made, found, done, limits)
    content |= {"trust": run.content["verdict"], "remarks": run.content["remarks"]}
    content["provenance"] = provenance(made.found.evidence.arm, ())
    content["seconds"] = time.perf_counter() - start
    return DrivenGap(model_of(made.found), content, made, done)


def _content(
    made: BySimulation, found: DrivenSearch, done: DrivenOutcome, limits: SearchSettings
) -> dict[str, Any]:
    arm, moving = made.found.evidence.arm, made.found.evidence.moving
    left = _left_shares(done)
    return {
        "method": "simulation",
        "verdict": done.kind,
        "effects": [_effect(n, done) for n in done.effects],
        "suspected": [
            _effect(n, done) | {"doubt": n.doubt, "in_model": False} for n in done.suspected
        ],
        "where": [] if done.kind == "no_gap" else _where(made, done),
        "not_observable": [
            {"name": name, "joints": (np.flatnonzero(np.isnan(x) & moving) + 1).tolist()}
            for name, x in done.smallest.items()
            if (np.isnan(x) & moving).any()
        ],
        "not_asked": NOT_ASKED,
        "held_by_weight": [],
        "held_out": _held_out(made, done),
        "forward_simulation": {
            "before": {"rms_q_by_joint": done.base.rms.tolist()},
            "after": {"rms_q_by_joint": done.end.rms.tolist()},
        },
        "minimum_detectable": {
            name: {str(j + 1): float(x) for j, x in enumerate(sizes) if np.isfinite(x)}
            for name, sizes in done.smallest.items()
        },
        "detectable_units": {k.name: QUANTITIES[ROW[k.part.quantities[0]]].unit for k in KINDS},
        "unexplained": [
            {
                "joint": j + 1,
                "share_of_gap": float(left[j]),
                "rms": float(rms(done.after)[j]),
                "noise_floor": float(done.floor[j]),
            }
            for j in done.unexplained
        ],
        "servo": [
            {
                "name": name,
                "unit": QUANTITIES[ROW[name]].unit,
                "meaning": QUANTITIES[ROW[name]].text,
                "before": done.base.settings[ROW[name]].tolist(),
                "after": done.end.settings[ROW[name]].tolist(),
            }
            for name in _SHOWN
        ],
        "settings": limits.content() | {"least_gain": LEAST_GAIN},
        "arm": arm.name,
        "joints": list(arm.robot.joint_names),
        "moving": moving.tolist(),
        "resolution_rad": made.arm.setup.resolution.tolist(),
    }


def _left_shares(done: DrivenOutcome) -> Array:
    """Part of each joint's gap that is left, shape (n,)."""
    before, after = (rms(x) ** 2 - done.floor**2 for x in (done.before, done.after))
    return np.clip(after / np.maximum(before, 1e-30), 0.0, 1.0)


def _effect(n: Named, done: DrivenOutcome) -> dict[str, Any]:
    tried = n.step.tried
    kind, joint = tried.start.kind, tried.start.joint
    fit = done.end if not n.doubt else tried.fit
    parameters = {
        name: {
            "value": float(fit.settings[ROW[quantity], joint]),
            "sd": sd if np.isfinite(sd) else None,
            "unit": QUANTITIES[ROW[quantity]].unit,
        }
        for quantity, name, sd in zip(kind.part.quantities, kind.reported, n.sd, strict=True)
        if np.isfinite(sd) or fit.settings[ROW[quantity], joint]
    }
    return {
        "name": kind.name,
        "joints": [joint + 1],
        "parameters": parameters,
        "equation": kind.equation,
        "evidence": {
            "gain_nats_per_sample": tried.gain,
            "asked_nats_per_sample": LEAST_GAIN,
            "smallest_held_out_gain": min(n.gains),
            "held_out_parts": len(n.gains),
            "confirmed_parts": sum(g > 0.0 for g in n.gains),
            "effect_free_runs": 0,
            "standard_errors_over_blocks": tried.sure,
            "standard_deviations": n.deviations if np.isfinite(n.deviations) else None,
        },
        "rivals": [
            {"name": r.start.kind.name, "joints": [r.start.joint + 1], "evidence": r.gain}
            for r in n.step.rivals
        ],
        "separating_experiment": f"{kind.name}:{joint + 1}" if n.step.rivals else None,
    }


def _where(made: BySimulation, done: DrivenOutcome) -> list[dict[str, Any]]:
    """Joints and speeds at which the arm without effects is beyond the noise."""
    segments = made.arm.setup.segments
    speeds = [np.gradient(s.q, s.motion.t, axis=0)[s.counted :] for s in segments]
    slow = np.abs(np.concatenate(speeds)) < _SLOW
    beyond = (done.base.residuals / done.floor) ** 2 - 1.0
    shares = {
        (j, f"|qd| {sign} {_SLOW:g} rad/s"): max(float(beyond[here[:, j], j].sum()), 0.0)
        for here, sign in ((slow, "<"), (~slow, ">"))
        for j in range(beyond.shape[1])
    }
    whole = sum(shares.values())
    ordered = sorted(shares.items(), key=lambda pair: -pair[1])
    return [
        {"joint": j + 1, "region": region, "share_of_gap": x / whole}
        for (j, region), x in ordered
        if whole > 0.0 and x > _LEAST_SHARE * whole
    ]


def _held_out(made: BySimulation, done: DrivenOutcome) -> dict[str, Any]:
    """Position errors of blocks left out [rad], and relative to how far the joints moved."""
    moving = made.found.evidence.moving
    motion = np.concatenate([s.q for s in made.arm.setup.segments]).std(axis=0)

    before, after, floor = rms(done.before), rms(done.after), done.floor
    gap = float(np.sum((before**2 - floor**2)[moving]))
    closed = float(np.sum((before**2 - after**2)[moving])) / gap if gap > 0.0 else 0.0
    return {
        "unit": "rad",
        "measure": "rms",
        "before": position_errors(before, motion, moving),
        "after": position_errors(after, motion, moving),
        "noise_floor": position_errors(floor, motion, moving),
        "closed_fraction": min(max(closed, 0.0), 1.0) if done.effects else 0.0,
    }
