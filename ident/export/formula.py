"""The numbers of the torque formula, as generated programs hold them."""

import re
from dataclasses import dataclass

import numpy as np

from ident.export.left_out import (
    ExportedArm,
    LeftOut,
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


def left_out_of_formula(model: Model) -> list[LeftOut]:
    """Effects that one sample does not tell: those with a memory, and limits of the drive."""
    return effects_left_out(model, HELD, lambda term: bool(term.text))


def left_out_words(model: Model, name: str) -> list[str]:
    """What is left out, and which joints are not identified, as sentences without full stops."""
    left = sentence(name, left_out_of_formula(model))
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
