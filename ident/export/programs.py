"""Inverse dynamics as programs for controllers: a C header, and a Python module.

Both hold the numbers of one formula of the torque.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from ident.export.left_out import (
    ExportedArm,
    effects_left_out,
    exported_arm,
    sentence,
)
from ident.export.links import Link, held_joints, identified_links
from ident.model.identified_model import Model
from ident.signals.arrays import Array

HELD = (
    "chain",
    "delta",
    "armature",
    "viscous",
    "friction_rows",
    "coulomb",
    "gain",
    "encoder_zero",
)
"""Fields of the simulated arm that a formula of one sample has a place for."""

_NOT_PRINTED = re.compile(r"[^\x20-\x7e]|[\\*?\"@]")

Rows = Callable[[Array], str]


@dataclass(frozen=True)
class Formula:
    """A program's numbers.

    Attributes:
        exported: the arm.
        links: from the base outwards.
        rows: speed that each friction acts on, from the joints' speeds, shape (m, n).
        viscous, coulomb: of each [N m s/rad, N m], shape (m,).
        texts: torque of effects, by joint (from 0): see `Term.text`.
    """

    exported: ExportedArm
    links: list[Link]
    rows: Array
    viscous: Array
    coulomb: Array
    texts: list[tuple[int, str]]

    @property
    def offset(self) -> Array:
        """Constant torque of each joint [N m], shape (n,)."""
        return self.exported.model.parameter("fo")


def formula_of(model: Model) -> Formula:
    """The formula of a model, with the effects that one sample tells.

    Raises:
        DataError: parameters that no mass distribution can have, or an effect that is not known.
    """
    exported = exported_arm(model)
    arm, n = exported.arm, model.robot.dof
    viscous = np.zeros(len(arm.coulomb))
    viscous[:n] = arm.viscous
    drags = model.parameter("fvm")
    shared = np.flatnonzero(drags)
    return Formula(
        exported,
        identified_links(model, arm),
        np.vstack([arm.friction_rows, model.terms.drive_matrix[shared]]),
        np.append(viscous, drags[shared]),
        np.append(arm.coulomb, np.zeros(len(shared))),
        [part for term in exported.terms for part in term.text],
    )


def left_out_words(model: Model, name: str) -> list[str]:
    """What is left out, and which joints are not identified, as sentences without full stops.

    Left out are effects that one sample does not tell: those with a memory, and limits of the
    drive.
    """
    left = sentence(name, effects_left_out(model, HELD, lambda term: bool(term.text)))
    return left + [s for s in (held_joints(model),) if s]


def plain(text: str) -> str:
    """A foreign text for a comment: printable ASCII that cannot end it."""
    return _NOT_PRINTED.sub("_", text)


def identifier(text: str) -> str:
    """A foreign name as a name in a program; `arm` where nothing of it is left."""
    name = re.sub(r"\W", "_", text, flags=re.ASCII)
    return f"arm_{name}" if not name.strip("_") or name[0].isdigit() else name


def listed(values: Array | list[float]) -> str:
    """Numbers with all their digits, with commas in between."""
    return ", ".join(repr(float(x)) for x in values)


def to_c(model: Model) -> str:
    """A C header with the torque of links, friction, rotors and all effects of one sample.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    name = identifier(model.arm)
    names = {"name": name, "guard": f"{name.upper()}_DYNAMICS_H"}
    lines = "    tau[{}] += {};\n"
    return _filled("dynamics.h.txt", model, left_out_of_c(model), _c_rows, lines, names)


def to_python(model: Model) -> str:
    """A Python module with the same torque, which needs NumPy only.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    lines = "    tau[{}] += {}\n"
    return _filled("dynamics.py.txt", model, left_out_of_python(model), _python_rows, lines, {})


def left_out_of_c(model: Model) -> list[str]:
    """What the model holds and the header does not."""
    return left_out_words(model, "a C function of one sample")


def left_out_of_python(model: Model) -> list[str]:
    """What the model holds and the module does not."""
    return left_out_words(model, "a Python function of one sample")


def _filled(
    template: str, model: Model, left_out: list[str], rows: Rows, line: str, names: dict[str, str]
) -> str:
    """The template with the model's numbers; names of foreign files are in comments only."""
    formula = formula_of(model)
    words = {
        "arm": plain(model.arm),
        "words": plain("; ".join([f"{model.estimator} model", *left_out])),
        "joints": ", ".join(plain(n) for n in model.robot.joint_names),
        "effects": "".join(line.format(j, text) for j, text in formula.texts),
    }
    text = files("ident.export").joinpath(template).read_text(encoding="utf-8")
    for key, value in (_numbers(formula, rows) | words | names).items():
        text = text.replace(f"@{key}@", value)
    return text


def _numbers(formula: Formula, rows: Rows) -> dict[str, str]:
    links, arm = formula.links, formula.exported.arm
    return {
        "n": str(len(links)),
        "parent": ", ".join(str(-1 if x.parent is None else x.parent) for x in links),
        "slides": ", ".join(str(int(x.slides)) for x in links),
        "place": rows(np.array([x.placement[:3].ravel() for x in links])),
        "axis": rows(np.array([x.axis for x in links])),
        "moment": rows(np.array([x.mass * x.center for x in links])),
        "tensor": rows(np.array([x.tensor.ravel() for x in links])),
        "mass": listed([x.mass for x in links]),
        "gravity": listed(arm.chain.gravity),
        "zero": listed(arm.encoder_zero),
        "asked": rows(np.linalg.inv(arm.gain)),
        "offset": listed(formula.offset),
        "armature": rows(arm.armature),
        "rows": str(len(formula.rows)),
        "row": rows(formula.rows),
        "viscous": listed(formula.viscous),
        "coulomb": listed(formula.coulomb),
    }


def _c_rows(rows: Array) -> str:
    return ",\n".join(f"        {{{listed(row)}}}" for row in rows)


def _python_rows(rows: Array) -> str:
    return ",\n".join(f"    [{listed(row)}]" for row in rows)
