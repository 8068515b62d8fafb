"""Inverse dynamics as programs for controllers: a C header, and a Python module."""

from collections.abc import Callable
from importlib.resources import files

import numpy as np

from ident.export.formula import Formula, formula_of, identifier, left_out_words, listed, plain
from ident.export.left_out import Array
from ident.model.identified_model import Model

Rows = Callable[[Array], str]


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
