"""Axes, limits, frames and friction of joints."""

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from ident.urdf_check.finding import Finding, Grade, Repair
from ident.urdf_check.xml_values import Element, number, triple

_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_DRIVEN = ("revolute", "continuous", "prismatic")
_MOST_TURNS = 1.01 * 4 * np.pi
"""A joint's limit beyond two turns [rad], be they rounded up, is in degrees, or no limit."""

_MOST_DEGREES = 720.0
_FULL_TURN = 2 * np.pi
_BEYOND = 0.1
"""Positions so far beyond limits [rad] do not contradict them: limits are rounded, stops yield."""

_UNIT_LENGTH = 1e-3

Ranges = Mapping[str, tuple[float, float]]
"""Lowest and highest position of joints in a recording, by their names [rad or m]."""


def joint_findings(
    joint: Element, names: frozenset[str], moved: Ranges | None = None
) -> Iterator[Finding]:
    """What is wrong with a joint.

    Args:
        joint: the element.
        names: of all joints.
        moved: where a recording has them, if there is one.
    """
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind not in _TYPES:
        yield _fault("type", name, f"its type {kind!r} is none of {', '.join(_TYPES)}")
    yield from _origin(name, joint)
    if kind in (*_DRIVEN, "planar"):
        yield from _axis(name, joint)
    if kind in _DRIVEN:
        yield from _limits(name, joint, kind, (moved or {}).get(name, (0.0, 0.0)))
        yield from _friction(name, joint)
    mimic = joint.find("mimic")
    if mimic is not None and mimic.get("joint", "") not in names:
        yield _fault("mimic", name, f"mimics {mimic.get('joint')!r}, and there is no such joint")


def _origin(name: str, joint: Element) -> Iterator[Finding]:
    angles = triple(joint.find("origin"), "rpy")
    if angles is not None and np.abs(angles).max() > _FULL_TURN * (1 + 1e-6):
        yield _doubt(
            "origin_degrees",
            name,
            f"its frame is turned by {np.abs(angles).max():g} rad: rpy is in radians, and this"
            " looks like degrees",
        )


def _axis(name: str, joint: Element) -> Iterator[Finding]:
    axis = joint.find("axis")
    if axis is None:
        yield _note("axis_missing", name, "has no axis, so that readers take x (1 0 0)")
        return
    values = triple(axis, "xyz")
    length = 0.0 if values is None else float(np.linalg.norm(values))
    if values is not None and length > 0 and abs(length - 1) > _UNIT_LENGTH:
        words = " ".join(f"{x:.9g}" for x in values / length)
        yield _note(
            "axis_length",
            name,
            f"its axis {axis.get('xyz')} has the length {length:.4g} and not 1",
            partial(axis.set, "xyz", words),
            f"axis {words}",
        )


def _limits(name: str, joint: Element, kind: str, moved: tuple[float, float]) -> Iterator[Finding]:
    limit = joint.find("limit")
    if limit is None:
        if kind != "continuous":
            wanted = "lower, upper, effort and velocity"
            yield _fault("limit_missing", name, f"has no limit element: give {wanted}")
        return
    if kind != "continuous":
        yield from _range(name, limit, kind, moved)
    for what, unit in (("effort", "N m"), ("velocity", "rad/s")):
        value = number(limit, what)
        if limit.get(what) is None:
            yield _fault(f"{what}_missing", name, f"its limit has no {what} [{unit}]: give it")
        elif value is not None and value < 0:
            repaired = f"{-value:.9g}"
            yield _fault(
                f"{what}_negative",
                name,
                f"its {what} limit is {value:g} {unit}, below zero",
                partial(limit.set, what, repaired),
                f"{what} {repaired}",
            )
        elif value == 0:
            yield _note(f"{what}_zero", name, f"its {what} limit is zero, so that it cannot move")


def _range(name: str, limit: Element, kind: str, moved: tuple[float, float]) -> Iterator[Finding]:
    lower, upper = (number(limit, x) if limit.get(x) else 0.0 for x in ("lower", "upper"))
    if lower is None or upper is None or not np.isfinite([lower, upper]).all():
        return
    if lower > upper:
        yield _fault(
            "limit_reversed",
            name,
            f"its lower limit {lower:g} is above its upper limit {upper:g}",
            partial(_set_range, limit, upper, lower),
            f"from {upper:g} to {lower:g}",
        )
    elif lower == upper:
        yield _fault("limit_empty", name, f"its limits are both {lower:g}, so that it cannot move")
    most = max(abs(lower), abs(upper))
    if kind == "revolute" and _MOST_TURNS < most <= _MOST_DEGREES:
        yield _turns(name, limit, tuple(sorted((lower, upper))), moved)


def _turns(
    name: str, limit: Element, given: tuple[float, ...], moved: tuple[float, float]
) -> Finding:
    """Limits of more than two turns; no degrees where a recording passes them as such.

    A recording that has as many turns itself may be in degrees as well, and says nothing.
    """
    text = f"its limits {given[0]:g} and {given[1]:g} rad are more than two turns"
    low, high = np.radians(given)
    passes = moved[0] < low - _BEYOND or moved[1] > high + _BEYOND
    if passes and max(np.abs(moved)) <= _MOST_TURNS:
        text = (
            f"{text}, and no degrees either, since the recording moves it from {moved[0]:.3g} to"
            f" {moved[1]:.3g} rad: give those of the joint"
        )
        return _doubt("limit_turns", name, text)
    return _doubt(
        "limit_degrees",
        name,
        f"{text}: they look like degrees",
        partial(_set_range, limit, low, high),
        f"from {low:.5g} to {high:.5g} rad",
    )


def _set_range(limit: Element, lower: float, upper: float) -> None:
    limit.set("lower", f"{lower:.9g}")
    limit.set("upper", f"{upper:.9g}")


def _friction(name: str, joint: Element) -> Iterator[Finding]:
    dynamics = joint.find("dynamics")
    for what in ("damping", "friction"):
        value = number(dynamics, what)
        if dynamics is not None and value is not None and value < 0:
            yield _fault(
                f"{what}_negative",
                name,
                f"its {what} is {value:g}: it would drive the joint",
                partial(dynamics.set, what, "0"),
                f"{what} 0",
            )


def _of(
    grade: Grade, code: str, name: str, sentence: str, repair: Repair | None = None, to: str = ""
) -> Finding:
    return Finding(grade, code, "joint", name, sentence, repair, to)


_fault, _doubt, _note = (partial(_of, grade) for grade in (Grade.FAULT, Grade.DOUBT, Grade.NOTE))
