"""Where recordings of one run contradict each other, parameter by parameter, and what it means."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ident.checks.remark import Grade, Remark, joined
from ident.checks.settings import DEFAULT, CheckSettings
from ident.estimation.regression_data import RegressionData
from ident.identification.agreement import (
    Change,
    Comparison,
    beside_others,
    compared,
    groups,
)
from ident.identification.torque_delay import Delay

_MEANING: dict[Change, str] = {
    "friction": "Different friction alone would explain it: the drives were colder or warmer,"
    " lubricated differently, or moved at speeds between which friction is no straight line.",
    "load": "A different load on the last link alone would explain it: a tool or payload was"
    " changed.",
    "other": "Neither friction nor a load on the last link alone would explain it.",
}
_ADVICE: dict[Change, str] = {
    "friction": "Warm the arm up in the same way and move at the same speeds each time, or identify"
    " the recordings separately.",
    "load": "Identify the recordings separately.",
    "other": "Check whether the mounting, joint zeros or torque sensors were changed.",
}
_SEARCH = " If they were not, let `ident gap` search for what the model lacks."
_MOST_NAMED = 4
_DELAY_S = 3e-3
_SURE = 5.0  # standard errors of a delay


def contradictions(
    evidence: RegressionData,
    delays: Sequence[Delay] = (),
    bounds: CheckSettings = DEFAULT,
    searched: bool = False,
    delay_s: float | None = None,
) -> tuple[list[Remark], list[dict[str, Any]]]:
    """Recordings that contradict the others: remarks, and `recordings_disagree` of `run.json`.

    The one that contradicts most is told, and set aside before the rest are compared; where no
    single one does, it may be a group, as where half of them were made with a tool. Where the
    torque of the recordings is late or early, that is told first: it passes for other parameters.

    Args:
        evidence: the recordings, reduced.
        delays: of each.
        bounds: of the checks.
        searched: whether what the model lacks has been searched, and is taken off.
        delay_s: the delay that is set already, beside which those of the recordings were found.
    """
    remarks, rows = [], []
    first, last = _delayed(delays, delay_s or 0.0), "" if searched else _SEARCH
    while len(evidence.logs) > 1:
        logs, found = _worst(evidence, bounds)
        if _ratio(found, bounds) < bounds.disagree_ratio:
            break
        places = _contradicting(found, bounds)
        advice = f"{first}{_ADVICE[found.change]}"
        advice += last if found.change == "other" else ""
        remarks.append(_remark(evidence, logs, found, places, advice))
        rows += [_content(evidence, log, found, places) for log in logs]
        rest = tuple(log for i, log in enumerate(evidence.logs) if i not in logs)
        evidence = replace(evidence, logs=rest)
    return remarks, rows


def _worst(evidence: RegressionData, bounds: CheckSettings) -> tuple[list[int], Comparison]:
    """The recording that contradicts the others most, or the group if no single one does."""
    single = [([k], found) for k, found in enumerate(compared(evidence))]
    worst = max(single, key=lambda s: _ratio(s[1], bounds))
    if _ratio(worst[1], bounds) >= bounds.disagree_ratio:
        return worst
    apart = groups(evidence, bounds.disagree_ratio)
    several = [(logs, beside_others(evidence, logs)) for logs in apart]
    return max([worst, *several], key=lambda s: _ratio(s[1], bounds))


def _contradicting(found: Comparison, bounds: CheckSettings) -> list[int]:
    """Parameters beyond their intervals, the clearest first."""
    size = np.abs(found.deviations)
    return [int(i) for i in np.argsort(-size) if size[i] > bounds.disagree_deviations]


def _ratio(found: Comparison, bounds: CheckSettings) -> float:
    """Error under the others' parameters beside the usual one; zero where they agree.

    A short recording is fitted by itself nearly without an error, so that the error of the
    others' own fit counts as well.
    """
    usual = max(found.error, found.error_among_others)
    return found.error_of_others / usual if _contradicting(found, bounds) else 0.0


def _delayed(delays: Sequence[Delay], known_s: float = 0.0) -> str:
    """What to do first where most recordings show one sure delay beside the one that is set."""
    sure = [d.seconds for d in delays if abs(d.seconds) > max(_DELAY_S, _SURE * d.sd)]
    if 2 * len(sure) <= len(delays):
        return ""
    value = float(np.median(sure))
    return (
        f"Set delay_s: {known_s + value:.2g} first, since the torque seems to be"
        f" {1e3 * abs(value):.2g} ms {'early' if value > 0 else 'late'}, which passes for other"
        " parameters. "
    )


def _remark(
    evidence: RegressionData, logs: list[int], found: Comparison, places: list[int], advice: str
) -> Remark:
    base, rest = evidence.base, len(evidence.logs) - len(logs)
    which = joined([evidence.logs[k].data.name for k in logs])
    them = ("it", "its") if len(logs) == 1 else ("them", "their")
    named = [
        f"{base.names[i]} is {found.alone[i]:.3g} ± {found.sd[i]:.2g}, not {found.others[i]:.3g} ±"
        f" {found.others_sd[i]:.2g} {base.units[i]}"
        for i in places[:_MOST_NAMED]
    ]
    more = len(places) - len(named)
    text = (
        f"{which} contradict{'s' * (len(logs) == 1)} the other recording{'s' * (rest > 1)}:"
        f" {joined(named)}{f' (and {more} more)' if more else ''}. Parameters of the"
        f" other{'s' * (rest > 1)} predict {them[0]} with an error of"
        f" {100 * found.error_of_others:.3g} %, {them[1]} own with {100 * found.error:.3g} %."
        f" {_MEANING[found.change]}"
    )
    return Remark("recordings_disagree", (), text, Grade.DOUBTFUL, advice)


def _content(
    evidence: RegressionData, log: int, found: Comparison, places: list[int]
) -> dict[str, Any]:
    return {
        "name": evidence.logs[log].data.name,
        "change": found.change,
        "relative_error_percent": 100 * found.error,
        "relative_error_percent_of_others": 100 * found.error_of_others,
        "parameters": [
            {
                "name": evidence.base.names[i],
                "value": float(found.alone[i]),
                "sd": float(found.sd[i]),
                "others": float(found.others[i]),
                "others_sd": float(found.others_sd[i]),
                "unit": evidence.base.units[i],
            }
            for i in places
        ],
    }
