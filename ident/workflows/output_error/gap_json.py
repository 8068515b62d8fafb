"""The content of `gap.json` of a search by simulation, as the contract fixes it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.output_error.judging import typical
from ident.output_error.missing.kinds import KIND_OF, NOT_ASKED, effect_name
from ident.output_error.missing.verdict import Evidence, Outcome
from ident.output_error.missing.visibility import held_by_weight, smallest
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import Part
from ident.output_error.search.selection import Accepted
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Setup
from ident.signals.arrays import Array

Content = dict[str, Any]

_SLOW = 0.1  # rad/s
_LEAST_SHARE = 0.05


def gap_content(begun: Prepared, done: Outcome, settings: SearchSettings) -> Content:
    """All but remarks, provenance, and time."""
    arm = begun.arm
    seen = smallest(done.search, settings)
    held = held_by_weight(begun.setup, done.after.settings)
    for a in done.effects:
        seen[a.part][a.joint] = np.nan
    for part, sizes in seen.items():
        if part.quantities[0] == "half_play":
            sizes[held] = np.nan  # of no size would it have shown
    return {
        "method": "simulation",
        "verdict": done.kind,
        "effects": [
            _effect(a, e, done, done.after.settings, done.known.sd)
            for a, e in zip(done.effects, done.evidence, strict=True)
        ],
        "suspected": [
            _effect(s.effect, s.evidence, done, s.settings, s.sd)
            | {"doubt": s.doubt, "in_model": False}
            for s in done.suspected
        ],
        "where": _where(begun.setup, done),
        "not_observable": _not_observable(seen, begun.moving, done),
        "not_asked": NOT_ASKED,
        "held_by_weight": (np.flatnonzero(held & begun.moving) + 1).tolist(),
        "held_out": _held_out(begun, done),
        "forward_simulation": {
            "before": {"rms_q_by_joint": done.before.rms.tolist()},
            "after": {"rms_q_by_joint": done.after.rms.tolist()},
        },
        "minimum_detectable": {
            effect_name(p): {str(j + 1): float(x) for j, x in enumerate(sizes) if np.isfinite(x)}
            for p, sizes in seen.items()
        },
        "detectable_units": {
            effect_name(p): QUANTITIES[ROW[p.quantities[0]]].unit for p in done.search.asked
        },
        "unexplained": [
            {"joint": x.joint + 1, "share_of_gap": x.share, "rms": x.rms, "noise_floor": x.floor}
            for x in done.left
        ],
        "servo": _servo(done),
        "settings": settings.content(),
        "arm": arm.name,
        "joints": list(arm.robot.joint_names),
        "moving": begun.moving.tolist(),
        "resolution_rad": begun.resolution.tolist(),
    }


def _effect(a: Accepted, found: Evidence, done: Outcome, settings: Array, sd: Array) -> Content:
    deviations, beside = found.deviations, found.beside
    evidence: Content = {
        "gain_nats_per_sample": a.gain,
        "asked_nats_per_sample": a.asked,
        "smallest_held_out_gain": min(beside.gains),
        "held_out_parts": len(beside.gains),
        "confirmed_parts": sum(g > 0.0 for g in beside.gains),
        "effect_free_runs": done.search.nulls.runs,
        "standard_errors_over_blocks": beside.over_all,
        "standard_deviations": deviations if np.isfinite(deviations) else None,
        "explained_rms": a.explained,
    }
    if a.next_best is not None:
        evidence["next_best"] = f"{effect_name(a.next_best.part)} at [{a.joint + 1}]"
        evidence["next_best_gain"] = a.next_best.gain
    return {
        "name": effect_name(a.part),
        "joints": [a.joint + 1],
        "parameters": _parameters(a, settings, sd),
        "equation": KIND_OF[a.part].equation,
        "evidence": evidence,
        "rivals": [
            {"name": effect_name(r.part), "joints": [a.joint + 1], "evidence": r.gain}
            for r in a.rivals
        ],
        "separating_experiment": f"{effect_name(a.part)}:{a.joint + 1}" if a.rivals else None,
    }


def _parameters(a: Accepted, settings: Array, sds: Array) -> Content:
    found = {}
    kind = KIND_OF[a.part]
    named = list(zip(a.part.quantities, kind.reported, strict=True))
    named += [(a.part.form, kind.reported_form)] if a.part.form else []
    for quantity, name in named:
        row = ROW[quantity]
        sd = float(sds[row, a.joint])
        found[name] = {
            "value": float(settings[row, a.joint]),
            "sd": sd if np.isfinite(sd) else None,
            "unit": QUANTITIES[row].unit,
        }
    return found


def _where(setup: Setup, done: Outcome) -> list[Content]:
    """Joints and speeds at which the arm without effects is beyond the noise."""
    floor, excess = done.search.nulls.floor, {}
    for s, made in zip(setup.segments, setup.replay(done.before.settings), strict=True):
        speed = np.abs(np.gradient(made, s.motion.t, axis=0))
        beyond = (s.q - made) ** 2 - floor**2
        counted = np.arange(len(s.q)) >= s.counted
        for j in range(made.shape[1]):
            slow = speed[:, j] < _SLOW
            for here, sign in ((slow & counted, "<"), (~slow & counted, ">")):
                key = j, f"|qd| {sign} {_SLOW:g} rad/s"
                excess[key] = excess.get(key, 0.0) + float(beyond[here, j].sum() / floor[j] ** 2)
    most = sum(max(x, 0.0) for x in excess.values())
    shares = {k: max(x, 0.0) / most for k, x in excess.items()} if most > 0.0 else {}
    ordered = sorted(shares.items(), key=lambda pair: -pair[1])
    if done.kind == "no_gap":
        return []
    return [
        {"joint": j + 1, "region": region, "share_of_gap": share}
        for (j, region), share in ordered
        if share > _LEAST_SHARE
    ]


def _not_observable(
    seen: dict[Part, Array], moving: NDArray[np.bool_], done: Outcome
) -> list[Content]:
    """Effects that these motions do not show; those that were named are there."""
    hidden = {}
    for part, sizes in seen.items():
        named = [a.joint for a in done.effects if a.part == part]
        here = np.isnan(sizes) & moving
        here[named] = False
        hidden[effect_name(part)] = np.flatnonzero(here)
    return [{"name": k, "joints": [int(j) + 1 for j in x]} for k, x in hidden.items() if len(x)]


def _held_out(begun: Prepared, done: Outcome) -> Content:
    """Position errors of the typical second that is left out, by which effects are judged [rad].

    In a few seconds a joint that floats in its gears may be anywhere.
    """
    floor = done.search.nulls.typical
    before, after = typical(done.search.base.errors), typical(done.search.end.errors)
    q = np.concatenate([s.q for s in begun.setup.segments])
    motion, moving = q.std(axis=0), begun.moving

    at = sorted({a.joint for a in done.effects})
    gap = float(np.sum((before**2 - floor**2)[at])) if at else 0.0
    closed = float(np.sum((before**2 - after**2)[at])) / gap if gap > 0.0 else 0.0
    return {
        "unit": "rad",
        "measure": "rms of the typical second",
        "before": position_errors(before, motion, moving),
        "after": position_errors(after, motion, moving),
        "noise_floor": position_errors(floor, motion, moving),
        "closed_fraction": min(max(closed, 0.0), 1.0),
    }


def position_errors(rms: Array, motion: Array, moving: NDArray[np.bool_]) -> Content:
    """Errors by joint [rad], and relative to how far the joints moved, shape (n,) each."""
    relative = np.sqrt(np.sum(rms[moving] ** 2) / np.sum(motion[moving] ** 2))
    told = [float(x) if m else None for x, m in zip(rms, moving, strict=True)]
    return {"relative_error_percent": float(100.0 * relative), "rms_by_joint": told}


def _servo(done: Outcome) -> list[Content]:
    """What the servo model was fitted with, and standard errors of what it ends with."""
    sd = [[float(x) if np.isfinite(x) else None for x in row] for row in done.known.sd]
    rows = np.flatnonzero(done.before.free.any(axis=1))
    return [
        {
            "name": QUANTITIES[i].name,
            "unit": QUANTITIES[i].unit,
            "meaning": QUANTITIES[i].text,
            "before": done.before.settings[i].tolist(),
            "after": done.after.settings[i].tolist(),
            "sd": sd[i],
        }
        for i in rows
    ]
