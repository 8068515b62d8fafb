"""`run.json`, as the contract fixes it."""

import json
import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ident.dynamics.parameters import is_revolute
from ident.estimation.regression_data import ReducedRecording
from ident.identification.cross_validation import HeldOut
from ident.identification.drive_gains import DriveGains
from ident.identification.identify import Identification
from ident.identification.prediction_error import Assessment
from ident.identification.velocity_threshold import Sweep
from ident.model.arm import TERM_NAMES
from ident.regression.squared_errors import Errors
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot


def run_content(found: Identification) -> dict[str, Any]:
    """The content of `run.json`."""
    evidence = found.evidence
    process = evidence.logs[0].process
    culled = sum(int(log.reduction.culled.sum()) for log in evidence.logs)
    chosen = found.estimates[found.chosen]
    return {
        "arm": evidence.arm.name,
        "estimator": found.chosen,
        "samples": sum(log.data.samples for log in evidence.logs),
        "rows": int(evidence.counts.sum()),
        "joints": list(evidence.arm.robot.joint_names),
        "torque_units": torque_units(evidence.arm.robot),
        "moving": [bool(m) for m in evidence.moving],
        "logs": [log_content(log) for log in evidence.logs],
        "sample_rate_hz": evidence.logs[0].data.rate_hz,
        "cutoff_hz": process.cutoff_hz,
        "cutoff_from": process.reason,
        "culled_fraction": culled / (culled + int(evidence.counts.sum())),
        "velocity_threshold": process.threshold_rad_s,
        "rank": len(evidence.base.kept),
        "condition_number": found.condition_number,
        "estimators": {
            name: _estimator_content(assessment, found.held_out[name], found.estimates[name].note)
            for name, assessment in found.assessments.items()
        },
        "base_parameters": _table_content(found),
        "active_constraints": [
            {"joint": a.joint, "constraint": a.constraint, "multiplier": a.multiplier}
            | ({"direction": a.direction} if a.direction else {})
            for a in chosen.active
        ],
        "delays": [vars(d) for d in found.delays],
        "not_identified": {
            "without_effect": list(found.limits.without_effect),
            "only_combined": list(found.limits.only_combined),
            "invisible": list(found.limits.invisible),
            "hardly_told_apart": [list(names) for names in found.limits.confused],
        },
        "settings": evidence.arm.settings.model_dump(mode="json"),
        "terms": [name for name in TERM_NAMES if getattr(evidence.arm.terms, name)],
        "terms_tried": [asdict(trial) for trial in found.trials],
        "culling": _sweep_content(found.sweep),
        "solver": {"name": "Clarabel", "status": chosen.status, "seconds": chosen.seconds},
        "seconds": found.seconds,
    }


def _sweep_content(sweep: Sweep) -> dict[str, Any]:
    curves = {"slow": sweep.slow, "random": sweep.random, "other": sweep.other}
    return {
        "thresholds_rad_s": sweep.thresholds.tolist(),
        "removed": sweep.removed.tolist(),
        "automatic_choice_rad_s": sweep.choice,
    } | {
        name: {"condition_number": curve.condition.tolist(), "mse": curve.mse.tolist()}
        for name, curve in curves.items()
    }


def log_content(log: ReducedRecording) -> dict[str, Any]:
    """A recording as it stands in `run.json` and `validate.json`."""
    return {
        "name": log.data.name,
        "samples": log.data.samples,
        "sample_rate_hz": log.data.rate_hz,
        "torque": log.data.torque,
        "cutoff_hz": log.process.cutoff_hz,
        "remarks": list(log.data.facts),
    }


def torque_units(robot: Robot) -> list[str]:
    """Unit of each joint's torque; a sliding joint has a force."""
    return ["N m" if is_revolute(robot, k) else "N" for k in range(1, robot.dof + 1)]


def errors_content(errors: Errors) -> dict[str, Any]:
    """Errors as they stand in `run.json` and `validate.json`; a held joint has null."""
    return {
        "mse": errors.mse,
        "relative_error_percent": errors.relative_percent,
        "relative_error_percent_by_joint": numbers(errors.relative_percent_by_joint),
        "rms_by_joint": numbers(errors.rms_by_joint),
    }


def numbers(values: Array) -> list[float | None]:
    """Numbers for JSON, which knows no NaN."""
    return [None if math.isnan(x) else float(x) for x in values]


def _estimator_content(assessment: Assessment, held_out: HeldOut, note: str) -> dict[str, Any]:
    content = errors_content(assessment.filtered) | {
        "feasible": assessment.feasible,
        "min_pseudo_inertia_eigenvalue": assessment.smallest_eigenvalue,
        "mass_matrix_positive_fraction": assessment.positive_fraction,
        "negative": list(assessment.negative),
        "raw_torque": errors_content(assessment.raw),
        "held_out": errors_content(held_out.errors)
        | {"relative_error_percent_sd": held_out.sd_percent},
    }
    return content | ({"note": note} if note else {})


def _table_content(found: Identification) -> list[dict[str, Any]]:
    base = found.evidence.base
    beta = {name: estimate.beta for name, estimate in found.estimates.items()}
    rows = []
    for i, (name, unit) in enumerate(zip(base.names, base.units, strict=True)):
        known = base.kept_parameters[i].kind == "inertial"
        rows.append(
            {
                "name": name,
                "cad": float(beta["cad"][i]) if known and "cad" in beta else None,
                "ols": float(beta["ols"][i]),
                "sd": float(found.sd[i]),
                "feasible": float(beta["feasible"][i]),
                "unit": unit,
            }
            | {found.chosen: float(beta[found.chosen][i])}
        )
    return rows


def as_json(content: dict[str, Any] | list[Any]) -> str:
    """Readable JSON."""
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def with_uncertain_gains(found: Identification, gains: DriveGains) -> Identification:
    """The identification with the errors of the gains in its standard errors.

    Links take part in the common factor, a joint's friction in its own gain. What is infinitely
    uncertain stays as it is: its remark and its unknown gain say so.
    """
    beta = found.estimates["ols"].beta
    kept = found.evidence.base.kept_parameters
    of_joint = gains.relative_sd
    relative = np.array(
        [gains.common_sd if p.kind == "inertial" else of_joint[p.index - 1] for p in kept]
    )
    finite = np.where(np.isfinite(relative), relative, 0.0)
    return replace(found, sd=np.hypot(found.sd, finite * beta))


def currents_content(
    content: dict[str, Any], fit_sd: Array, gains: DriveGains, found: Identification
) -> dict[str, Any]:
    """What `run.json` holds beside the usual where efforts were currents.

    Args:
        content: of `run.json`.
        fit_sd: standard errors of the base parameters for given gains, shape (b,).
        gains: of the drives.
        found: the identification.
    """
    rows = []
    kept = found.evidence.base.kept_parameters
    for row, sd, p in zip(content["base_parameters"], fit_sd, kept, strict=True):
        gain = float(gains.value[p.index - 1])
        rows.append(row | {"ols_ampere": row["ols"] / gain, "sd_ampere": float(sd) / gain})
    drives = [
        {
            "joint": k + 1,
            "nm_per_ampere": float(value),
            "sd": float(value * sd) if np.isfinite(sd) else None,
            "from": source,
        }
        for k, (value, sd, source) in enumerate(
            zip(gains.value, gains.relative_sd, gains.source, strict=True)
        )
    ]
    return content | {"torque_unit": "A", "gains": drives, "base_parameters": rows}
