"""What a run tells of drives whose currents were recorded."""

from dataclasses import replace
from typing import Any

import numpy as np

from ident.identification.drive_gains import DriveGains
from ident.identification.identify import Identification
from ident.signals.arrays import Array


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
