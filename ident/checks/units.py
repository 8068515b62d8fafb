"""Torque in another unit, and currents: one factor over all joints, or one at each joint."""

import numpy as np

from ident.checks.gains import Gains
from ident.checks.remark import Grade, Remark
from ident.checks.settings import CheckSettings
from ident.checks.words import joined, joints, numbers

MENDED = (1000.0, 0.001)
"""Units whose factor is taken for no current and no gear."""

UNITS = {
    1000.0: "N mm (mN m)",
    0.001: "kN m",
    141.6: "ozf in",
    100.0: "N cm",
    10.2: "kgf cm",
    8.85: "lbf in",
    0.102: "kgf m",
}
"""Numbers that a torque of 1 N m has in other units."""


def unit_factor(found: Gains, bounds: CheckSettings) -> float | None:
    """The unit that the torque has instead of N m, in numbers per N m; None where none is sure."""
    if not _outside(found, bounds):
        return None
    near = [
        u
        for u in MENDED
        if 1 / bounds.unit_tolerance < abs(found.common) / u < bounds.unit_tolerance
    ]
    return near[0] if len(near) == 1 else None


def _outside(found: Gains, bounds: CheckSettings) -> bool:
    size = abs(found.common)
    believed = found.common_explained > bounds.gain_explained
    return believed and not 1 / bounds.gain_bounds < size < bounds.gain_bounds


def unit_remarks(found: Gains, names: tuple[str, ...], bounds: CheckSettings) -> list[Remark]:
    """What is said of the torque's size; a sure unit is converted, and its result doubtful."""
    factor = unit_factor(found, bounds)
    if factor is not None:
        text = (
            f"The torque is {abs(found.common):.3g} times what the arm's own weight asks for: it"
            f" looks like {UNITS[factor]}, and was divided by {factor:g} here; record N m."
        )
        return [Remark("units", (), text, Grade.DOUBTFUL)]
    if _outside(found, bounds):
        near = [name for u, name in UNITS.items() if 0.5 < abs(found.common) / u < 2.0]
        like = f" ({joined(near).replace(' and ', ' or ')}?)" if near else ""
        text = (
            f"The torque is {abs(found.common):.3g} times what the arm's own weight asks for: it is"
            f" in another unit{like}, ahead of the gears, or a current; give joint torque in N m"
            " (a current times torque constant and gear ratio)."
        )
        return [Remark("units", (), text, Grade.REFUSED)]
    return [*_strange(found, bounds), *_apart(found, names, bounds)]


def _strange(found: Gains, bounds: CheckSettings) -> list[Remark]:
    """Torque that is not this arm's, for all that its URDF says."""
    if not found.value.any() or found.common_explained > bounds.cad_doubtful:
        return []
    text = (
        f"The URDF's links explain only {100 * max(found.common_explained, 0.0):.0f} % of the"
        " torque beside friction: look whether the URDF belongs to this arm, its zero poses and"
        " mounting are right, its inertials are more than placeholders, and gravity was not taken"
        " off the torque."
    )
    return [Remark("cad_disagrees", (), text, Grade.DOUBTFUL)]


def _apart(found: Gains, names: tuple[str, ...], bounds: CheckSettings) -> list[Remark]:
    """Joints whose torque has factors of their own: currents, or masses that the URDF lacks."""
    sure = (found.explained > bounds.gain_explained) & (np.abs(found.value) > 5 * found.sd)
    if sure.sum() < 2:
        return []
    size = np.abs(np.where(sure, found.value, np.nan))
    middle = np.nanmedian(size)
    odd = sure & ((size > bounds.gain_apart * middle) | (size < middle / bounds.gain_apart))
    places = np.flatnonzero(odd)
    if not len(places):
        return []
    listed = joined([f"{found.value[k]:.3g} ± {found.sd[k]:.2g}" for k in places])
    rest = np.flatnonzero(sure & ~odd)
    others = f"{np.nanmin(size[rest]):.2g} to {np.nanmax(size[rest]):.2g}"
    text = (
        f"The effort of {joints(places, names)} is {listed} times what the URDF's links ask for,"
        f" that of {joints(rest, names)} {others} times: it looks like a current or a motor's"
        " torque with a factor of its own at each joint, or like a load that the"
        " URDF lacks."
    )
    return [Remark("current_not_torque", numbers(places), text, Grade.DOUBTFUL)]
