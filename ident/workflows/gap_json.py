"""The content of `gap.json`, as the contract fixes it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ident.checks.remark import RefusedError, Remark, verdict_content
from ident.dynamics.parameters import of_joint
from ident.effects.candidate import Value
from ident.effects.catalogue import catalogue
from ident.effects.events import CONTACT, DROPPED_SAMPLES
from ident.gap.data.experiment import Experiment
from ident.gap.lack_of_fit.remaining_structure import share_of
from ident.gap.naming.certainty import IMPOSSIBLE_ARM, Certainty, deviations
from ident.gap.naming.dependence import Dependence
from ident.gap.results.error_by_term import Step
from ident.gap.results.held_out_error import Errors, HeldOut, Share
from ident.gap.results.minimum_detectable import MinimumDetectable
from ident.gap.results.outcome import SearchResult
from ident.gap.results.unexplained import UnexplainedStructure
from ident.gap.selection.estimates import FinalEstimates
from ident.gap.selection.scoring import Score
from ident.gap.selection.state import AcceptedEffect
from ident.gap.transients.detect import Transient
from ident.signals.arrays import Array
from ident.workflows.run_json import numbers
from ident.workflows.work import recordings_content

Content = dict[str, Any]

_NEAREST = 2
_LEAST_SHARE = 0.25  # of a structure's gain, from which an effect is called near to it


def trust_content(remarks: Sequence[Remark]) -> Content:
    """`trust` and `remarks`: how far the recordings themselves can be trusted."""
    found = verdict_content(remarks)
    return {"trust": found["verdict"], "remarks": found["remarks"]}


def refused_gap(source: Experiment, refusal: RefusedError, seconds: float) -> Content:
    """The content of `gap.json` where the recordings are refused: every field, and no effect."""
    arm, dof = source.arm, source.arm.robot.dof
    nothing = {"relative_error_percent": None, "rms_by_joint": [None] * dof}
    still = {"rms_q_by_joint": [None] * dof}
    return trust_content(refusal.remarks) | {
        "verdict": "data_fault",
        "effects": [],
        "suspected": [],
        "where": [],
        "not_observable": [],
        "held_out": {"before": nothing, "after": nothing, "noise_floor": nothing}
        | {"closed_fraction": None},
        "forward_simulation": {"before": still, "after": still},
        "minimum_detectable": {},
        "detectable_units": {},
        "arm": arm.name,
        "joints": list(arm.robot.joint_names),
        "logs": recordings_content(source.datasets),
        "seconds": seconds,
    }


def effects_content(
    found: SearchResult,
    final: FinalEstimates | None,
    leaning: Sequence[Sequence[Dependence]],
) -> list[Content]:
    """Entries of all effects and transients, or of the data's faults.

    Args:
        found: the search.
        final: values on all data; None where the data have faults.
        leaning: for each effect of the model, what its values lean on.
    """
    verdict = found.verdict
    if verdict.faults:
        return [
            _entry(DROPPED_SAMPLES.id, (), {}, f.text, {"count": f.count}, [], None)
            for f in verdict.faults
        ]
    entries = []
    if final is not None:
        each = zip(verdict.effects, final.parameters, leaning, strict=False)
        entries = [_accepted(found, *parts) for parts in each]
    return [*entries, *(_contact(found, b) for b in verdict.transients)]


def _accepted(
    found: SearchResult,
    item: AcceptedEffect,
    values: Mapping[str, Value],
    leaning: Sequence[Dependence],
) -> Content:
    h = item.candidate
    effect = catalogue()[h.effect]
    evidence = {
        "standard_deviations": _finite(deviations(h, values)),
        "gain_nats_per_sample": item.score.gain,
        "asked_nats_per_sample": found.threshold.of(h.effect),
        "smallest_held_out_gain": min(item.held_out, default=None),
        "held_out_parts": len(item.held_out),
        "confirmed_parts": sum(gain > 0.0 for gain in item.held_out),
        "effect_free_runs": found.threshold.draws,
        "leans_on": [_leaning(d) for d in leaning],
        "taken_for_granted": effect.assumption_of(h),
    }
    if item.next_best is not None:
        rival = item.next_best.candidate
        evidence["next_best"] = f"{rival.effect} at {[j + 1 for j in rival.joints]}"
        evidence["next_best_gain"] = item.next_best.gain
    rivals = [_rival(r) for r in item.rivals]
    experiment = _experiment(h.effect, h.joints) if rivals else None
    return _entry(
        h.effect, h.joints, _parameters(values), effect.equation_of(h), evidence, rivals, experiment
    )


def in_own_units(entries: Sequence[Content], sliding: Sequence[bool]) -> list[Content]:
    """Effects with the units that their joints have: N and m where one slides."""

    def parameters(entry: Content) -> Content:
        joints, named = entry["joints"], entry["parameters"]
        if entry["name"] == CONTACT.id:
            at = {f"torque_{j}": sliding[j - 1] for j in joints}
        else:
            at = dict.fromkeys(named, len(joints) == 1 and sliding[joints[0] - 1])
        return {
            name: p | {"unit": of_joint(p["unit"], True)} if at.get(name) else p
            for name, p in named.items()
        }

    return [entry | {"parameters": parameters(entry)} for entry in entries]


def suspected_content(found: SearchResult, final: FinalEstimates) -> list[Content]:
    """Effects that help prediction and contacts, if they are not sure enough to be named.

    Args:
        found: the search.
        final: values of what is in the model, with a name or without one.
    """
    places = ((h.effect, h.joints) for h in final.effects)
    of_model = dict(zip(places, final.parameters, strict=True))
    effects = [
        _entry(
            s.candidate.effect,
            s.candidate.joints,
            _parameters(of_model.get(s.effect.place, s.parameters)),
            catalogue()[s.candidate.effect].equation_of(s.candidate),
            {"gain_nats_per_sample": s.effect.score.gain} | _certainty(s.certainty),
            [_rival(r) for r in s.effect.rivals],
            _experiment(s.candidate.effect, s.candidate.joints),
        )
        | {"doubt": s.doubt, "in_model": s.in_model}
        for s in found.verdict.suspected
    ]
    return effects + [_unsure_contact(found, b) for b in found.verdict.unsure_transients]


def _unsure_contact(found: SearchResult, transient: Transient) -> Content:
    asked = found.options.settings.naming.z
    doubt = (
        f"its torque is {transient.deviations.max():.1f} standard deviations from what is left"
        f" elsewhere, and {asked:g} are asked for"
    )
    if transient.deviations.max() >= asked:
        doubt = IMPOSSIBLE_ARM
    if transient.at_start:
        doubt = "it begins with the recording, and what friction held before is not known"
    return _contact(found, transient) | {"doubt": doubt, "in_model": False}


def _parameters(values: Mapping[str, Value]) -> Content:
    """Those that the recordings determine."""
    return {
        name: {"value": v.value, "sd": v.sd, "unit": v.unit}
        for name, v in values.items()
        if math.isfinite(v.sd)
    }


def _certainty(c: Certainty) -> Content:
    return {
        "standard_deviations": _finite(c.deviations),
        "largest_torque": c.peak,
        "torque_resolution": c.resolution,
        "explained_rms": c.explained,
        "gain_across_recordings": c.across,
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def _leaning(d: Dependence) -> Content:
    return {
        "name": d.other.effect,
        "joints": [j + 1 for j in d.other.joints],
        "parameter": d.parameter,
        "value_without": d.without,
        "unit": d.unit,
    }


def _rival(score: Score) -> Content:
    h = score.candidate
    return {"name": h.effect, "joints": [j + 1 for j in h.joints], "evidence": score.gain}


def _experiment(effect: str, joints: Sequence[int]) -> str:
    """The argument of `ident design --for`."""
    return f"{effect}:{joints[0] + 1}" if joints else effect


def _contact(found: SearchResult, transient: Transient) -> Content:
    each = zip(transient.joints, transient.torque, transient.sd, strict=True)
    parameters: dict[str, Any] = {
        f"torque_{j + 1}": {"value": float(torque), "sd": float(sd), "unit": "N m"}
        for j, torque, sd in each
    }
    for edge, at_s in ("start", transient.start_s), ("end", transient.end_s):
        parameters[edge] = {"value": at_s, "sd": found.rows.hop_s, "unit": "s"}
    evidence = {
        "standard_deviations": _finite(float(transient.deviations.max())),
        "gain_nats_per_sample": transient.gain,
        "asked_nats_per_sample": found.threshold.of(CONTACT.id),
        "log": transient.log + 1,
    }
    return _entry(CONTACT.id, transient.joints, parameters, CONTACT.equation, evidence, [], None)


def _entry(
    name: str,
    joints: Sequence[int],
    parameters: Content,
    equation: str,
    evidence: Content,
    rivals: list[Content],
    experiment: str | None,
) -> Content:
    return {
        "name": name,
        "joints": [j + 1 for j in joints],
        "parameters": parameters,
        "equation": equation,
        "evidence": evidence,
        "rivals": rivals,
        "separating_experiment": experiment,
    }


def unexplained_content(found: SearchResult) -> list[Content]:
    """Unexplained structure: where it is, what it depends on, and the nearest effects."""
    return [_unexplained(found, n) for n in found.verdict.unexplained]


def _unexplained(found: SearchResult, item: UnexplainedStructure) -> Content:
    left, inside = item.structure, {(h.effect, h.joints) for h in found.end.accepted}
    nearest: dict[str, Content] = {}
    for score in found.last_scores:
        tried, here = score.candidate, score.fit.gains_over(found.end.fit)[left.joint]
        new = left.joint in tried.rows and (tried.effect, tried.joints) not in inside
        if new and here > _LEAST_SHARE * left.gain:
            entry = {"name": tried.effect, "joints": [j + 1 for j in tried.joints]}
            sizes = {"evidence": score.gain, "share_of_residual": share_of(here)}
            nearest.setdefault(tried.effect, entry | sizes)
    return {
        "joint": left.joint + 1,
        "depends_on": left.group,
        "share_of_residual": left.share,
        "unexplained": item.share_of_gap,
        "nearest": list(nearest.values())[:_NEAREST],
    }


def where_content(shares: Sequence[Share], sliding: Sequence[bool]) -> list[Content]:
    """Joints and regions of the gap."""
    return [
        {
            "joint": s.joint + 1,
            "region": of_joint(s.region, sliding[s.joint]),
            "share_of_gap": s.share,
        }
        for s in shares
    ]


def held_out_content(found: HeldOut) -> Content:
    """Errors on held-out data; without repeats the noise floor is null."""
    floor = found.noise_floor
    nothing = Errors(math.nan, np.full(len(found.before.rms), np.nan))
    return {
        "before": _errors(found.before),
        "after": _errors(found.after),
        "noise_floor": _errors(nothing if floor is None else floor),
        "closed_fraction": found.closed,
        "other_recordings": {
            "before": _errors(found.others_before or nothing),
            "after": _errors(found.others_after or nothing),
        },
    }


def steps_content(found: Sequence[Step]) -> list[Content]:
    """From the rigid body to the model with all effects."""
    return [
        {
            "added": s.added,
            "joints": [j + 1 for j in s.joints],
            "relative_error_percent": s.relative_percent,
        }
        for s in found
    ]


def _errors(errors: Errors) -> Content:
    percent = errors.relative_percent
    return {
        "relative_error_percent": None if math.isnan(percent) else percent,
        "rms_by_joint": numbers(errors.rms),
    }


def forward_content(before: Array, after: Array) -> Content:
    """Rms position errors of the simulated closed loop [rad]; null where it is unknown."""
    return {
        "before": {"rms_q_by_joint": numbers(before)},
        "after": {"rms_q_by_joint": numbers(after)},
    }


def visibility_content(seen: MinimumDetectable) -> tuple[list[Content], Content]:
    """`not_observable` and `minimum_detectable`."""
    unobservable = [
        {"name": name, "joints": [j + 1 for j in joints]}
        for name, joints in seen.unobservable.items()
    ]
    unobservable += [
        {"name": name, "joints": [], "lacks": catalogue()[name].asks_of_arm}
        for name in seen.unsearched
    ]
    sizes = {
        name: {str(j + 1): size for j, size in sorted(by.items())}
        for name, by in seen.sizes.items()
    }
    return unobservable, sizes
