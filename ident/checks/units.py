"""Torque in another unit, and currents: one factor over all joints, or one at each joint."""

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.gains import Gains, Load, load_of, of_rotors
from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.checks.settings import CheckSettings

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

_HEAVIEST = 2000.0
"""Mass of all links over the cube of the reach, above which it is not in kg: 6 to 220 [kg/m^3]."""

_LEAST_JOINTS = 3
"""Of an arm: what turns or slides about one place may be as heavy as it likes."""

_GIVE_LOAD = "Give a URDF with every load."


def unit_factor(case: Case, found: Gains, bounds: CheckSettings) -> float | None:
    """The unit that the torque has instead of N m, in numbers per N m; None where none is sure."""
    if not _outside(found, bounds) or _too_heavy(case):
        return None
    near = [
        u
        for u in MENDED
        if 1 / bounds.unit_tolerance < abs(found.common) / u < bounds.unit_tolerance
    ]
    return near[0] if len(near) == 1 else None


def _outside(found: Gains, bounds: CheckSettings) -> bool:
    """Whether the torque of all joints is of another size.

    A joint whose torque alone is a thousand times too large makes all of the common factor: where
    several joints tell theirs, most have to be of that size.
    """
    sure, size = _sure(found, bounds), abs(found.common)
    middle = float(np.median(np.abs(found.value[sure]))) if sure.any() else size
    large = min(size, middle) >= bounds.gain_bounds
    small = max(size, middle) <= 1 / bounds.gain_bounds
    return found.common_explained > bounds.gain_explained and (large or small)


def _sure(found: Gains, bounds: CheckSettings) -> NDArray[np.bool_]:
    """Joints that tell a gain of their own, shape (n,)."""
    return (found.explained > bounds.gain_explained) & (np.abs(found.value) > 5 * found.sd)


def unit_remarks(case: Case, found: Gains, tells: bool, bounds: CheckSettings) -> list[Remark]:
    """What is said of the torque's size; a sure unit is converted, and its result doubtful.

    Args:
        case: the recording.
        found: its torque beside the URDF's.
        tells: whether its motion tells the arm's parameters apart; the URDF's inertia may be what
            is wrong where it does not.
        bounds: of the checks.
    """
    factor = unit_factor(case, found, bounds)
    if factor is not None:
        text = (
            f"The torque is {abs(found.common):.4g} times what the URDF's links require, so it"
            f" was taken to be in {UNITS[factor]} and converted."
        )
        return [Remark("units", (), text, Grade.DOUBTFUL, "Record the torque in N m.")]
    if _outside(found, bounds) and _too_heavy(case):
        text = (
            f"The torque is {abs(found.common):.3g} times what the URDF's links require, which"
            f" weigh {_mass_kg(case):,.0f} kg at a reach of {_reach_m(case):.2g} m: no arm does, so"
            " the URDF's masses are in gram, or its lengths in another unit than m."
        )
        return [Remark("cad_disagrees", (), text, Grade.DOUBTFUL, "Give the URDF in kg and m.")]
    if _outside(found, bounds):
        load = load_of(case, found)
        light = load.mass_kg is None or load.mass_kg < bounds.load_masses * _mass_kg(case)
        if light and load.explains(bounds.load_ratio) and load.left < bounds.load_left:
            text = (
                f"The torque is {abs(found.common):.3g} times what the URDF's links require:"
                f" {_lacking(load)}."
            )
            return [Remark("cad_disagrees", (), text, Grade.DOUBTFUL, _GIVE_LOAD)]
        near = [name for u, name in UNITS.items() if 0.5 < abs(found.common) / u < 2.0]
        like = f" ({joined(near).replace(' and ', ' or ')}?)" if near else ""
        text = (
            f"The torque is {abs(found.common):.3g} times what the URDF's links require: it is in"
            f" another unit{like}, measured before the gears, or a current, or the URDF's masses or"
            " inertias are wrong."
        )
        advice = (
            "Give joint torque in N m (a current times torque constant and gear ratio), or set"
            " torque_unit: A in the identification section of the arm's file to have the gains"
            " estimated."
        )
        return [Remark("units", (), text, Grade.REFUSED if tells else Grade.DOUBTFUL, advice)]
    apart = _apart(case, found, bounds)
    if not apart and (size := _size_apart(found, bounds)):
        return size
    one = [] if apart else _one_factor(case, found, bounds)
    return one or apart or _strange(case, found, bounds)


def _mass_kg(case: Case) -> float:
    """Mass of all links by the URDF [kg]."""
    return float(sum(link.mass for link in case.robot.model.inertias))


def _reach_m(case: Case) -> float:
    """The joints' distances from each other, and of the last link's centre from its joint [m]."""
    model = case.robot.model
    steps = [p.translation for p in list(model.jointPlacements)[2:]]
    return float(sum(map(np.linalg.norm, [*steps, model.inertias[model.njoints - 1].lever])))


def _too_heavy(case: Case) -> bool:
    """Whether the URDF's links are heavier than an arm of that reach can be."""
    too_heavy = _mass_kg(case) > _HEAVIEST * _reach_m(case) ** 3
    return too_heavy and case.robot.dof >= _LEAST_JOINTS


def _size_apart(found: Gains, bounds: CheckSettings) -> list[Remark]:
    """Torque of another order of magnitude than the URDF's, whatever course that one takes."""
    weight = float(found.weight.sum())
    size = np.sqrt(found.torque / weight) if weight > 0 else 1.0
    if 1 / bounds.size_apart < size < bounds.size_apart:
        return []
    text = (
        f"Beyond friction, the torque is {size:.2g} times as large as the URDF's links require,"
        f" which account for only {100 * max(found.common_explained, 0.0):.0f} % of its course: it"
        " is in another unit, or the URDF's masses are placeholders."
    )
    advice = "Give joint torque in N m, and check the URDF's masses."
    return [Remark("units", (), text, Grade.DOUBTFUL, advice)]


def _one_factor(case: Case, found: Gains, bounds: CheckSettings) -> list[Remark]:
    """One factor at all joints that explains the torque, and no load does: no masses differ so."""
    size, left = abs(found.common), 1.0 - found.common_explained
    if 1 / bounds.one_factor < size < bounds.one_factor or left > bounds.one_factor_left:
        return []
    if left > bounds.load_ratio * load_of(case, found).left:
        return []
    whose, names = "all joints", case.robot.joint_names
    sure = (found.explained > bounds.gain_explained) & (found.value != 0.0)
    ratio = np.abs(found.value) / size
    apart = np.abs(np.abs(found.value) - size) > 5 * found.sd
    odd = sure & apart & ((ratio > bounds.one_factor) | (ratio < 1 / bounds.one_factor))
    if odd.any() and (sure & ~odd).any():
        whose = joints(np.flatnonzero(sure & ~odd), names)
        own = zip(found.value[odd], found.sd[odd], strict=True)
        others = joined([f"{x:.3g} ± {e:.2g}" for x, e in own])
        whose += f" (not that of {joints(np.flatnonzero(odd), names)}: {others} times)"
    text = (
        f"The torque of {whose} is {size:.3g} times what the URDF's links require, and with this"
        f" one factor they leave {100 * np.sqrt(left):.2g} % of it (rms) beyond friction: gears,"
        " torque constants or the unit are off by it, or the URDF's masses."
    )
    advice = "Check the gear ratios and torque constants that the torque was formed with."
    return [Remark("units", (), text, Grade.DOUBTFUL, advice)]


def _strange(case: Case, found: Gains, bounds: CheckSettings) -> list[Remark]:
    """Torque that is not this arm's, for all that its URDF says.

    The URDF's links have to explain a part of what other links would, or of their own weight.
    """
    if not found.value.any() or found.common_explained > bounds.cad_doubtful:
        return []
    by_others = 1.0 - float(np.sum(case.residual[case.probe.counted] ** 2)) / found.torque
    wanted = max(by_others, min(found.weight.sum() / found.torque, 1.0))
    if found.common_explained > bounds.cad_doubtful * wanted:
        return []
    text = (
        f"The URDF's links account for only {100 * max(found.common_explained, 0.0):.0f} % of the"
        " torque beyond friction."
    )
    advice = (
        "Check that the URDF belongs to this arm, that its zero positions, mounting and inertials"
        " are right, and that gravity was not subtracted from the recorded torque."
    )
    return [Remark("cad_disagrees", (), text, Grade.DOUBTFUL, advice)]


def _lacking(load: Load) -> str:
    """The load in words, with its evidence."""
    mass = "" if load.mass_kg is None else f" of about {load.mass_kg:.2g} kg"
    return (
        f"the URDF lacks a load{mass} at the last link (with it, its links"
        f" leave {100 * np.sqrt(load.left):.2g} % of the torque (rms) beyond friction)"
    )


def _apart(case: Case, found: Gains, bounds: CheckSettings) -> list[Remark]:
    """Joints whose torque has factors of their own: currents, or masses that the URDF lacks."""
    sure = _sure(found, bounds)
    if sure.sum() < 2:
        return []
    size = np.abs(np.where(sure, found.value, np.nan))
    middle = np.nanmedian(size)
    odd = sure & ((size > bounds.gain_apart * middle) | (size < middle / bounds.gain_apart))
    places = np.flatnonzero(odd & ~of_rotors(case, found)) if odd.any() else []
    if not len(places):
        return []
    listed = joined([f"{found.value[k]:.3g} ± {found.sd[k]:.2g}" for k in places])
    rest = np.flatnonzero(sure & ~odd)
    load, names = load_of(case, found), case.robot.joint_names
    others, tolerance = "", np.log(bounds.unit_tolerance)
    if len(rest):
        span = " to ".join(dict.fromkeys(f"{f(size[rest]):.2g}" for f in (np.min, np.max)))
        others = f", and that of {joints(rest, names)} {span} times"
    currents = (
        "these are currents or motor torques with a different factor at each joint (with such"
        f" factors, the URDF's links leave {100 * np.sqrt(load.left_by_factors):.2g} % of the"
        " torque (rms) beyond friction)"
    )
    estimate = "If they are currents, let `--set torque_unit=A` estimate the gains."
    readings, advice = [currents], estimate
    if load.explains(1 / bounds.load_ratio):
        first = load.explains(1.0)
        readings.insert(0 if first else 1, _lacking(load))
        advice = f"{_GIVE_LOAD} {estimate}" if first else f"{estimate} {_GIVE_LOAD}"
    unit = [u for u in MENDED if np.abs(np.log(size[places] / middle / u)).max() < tolerance]
    if unit:
        readings.insert(0, f"{'they are' if len(places) > 1 else 'it is'} in {UNITS[unit[0]]}")
        advice = f"Record all torques in N m. {advice}"
    text = (
        f"The effort of {joints(places, names)} is {listed} times what the URDF's links"
        f" require{others}: {', or '.join(readings)}."
    )
    return [Remark("current_not_torque", numbers(places), text, Grade.DOUBTFUL, advice)]
