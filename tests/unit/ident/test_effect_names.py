"""Nothing outside an effect's own file knows its name, and its equation holds its parameters."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

import ident
from ident.dynamics.compiled_chain import chain_of
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts
from ident.model.arm import TERM_NAMES
from ident.output_error.missing.kinds import KINDS
from wamctl.arm.config import load_arm_file

PACKAGE = Path(ident.__file__).parent
OTHER_METHODS = {"fleet", "watch", "output_error", "servos"}
"""Chapters and files with models of their own, which share words with the catalogue: kinds of
change of a fleet and of a watch, parameters of a servo."""


def test_no_effect_is_named_outside_its_own_file():
    """Terms of every model, such as the rotor's inertia, are known by their own name."""
    ids = set(catalogue()) - set(TERM_NAMES)
    found = {
        f"{path.relative_to(PACKAGE)}:{node.lineno} names {node.value}"
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in ids
        if not _own(path) and not _of_another_method(path)
    }
    assert found == set()


def _own(path: Path) -> bool:
    """Whether a file holds one effect; it may name its rivals."""
    return path.parent.name == "effects" and path.stem in catalogue()


def _of_another_method(path: Path) -> bool:
    return not OTHER_METHODS.isdisjoint({*path.parent.parts, path.stem})


def test_every_effect_has_a_file_of_its_name():
    assert all((PACKAGE / "effects" / f"{name}.py").exists() for name in catalogue())


def in_equation(name: str, equation: str) -> bool:
    """Whether a parameter stands there, itself or without the motor, axis or corner at its end."""
    words = re.findall(r"[a-z_]+", equation)
    return bool({name, name.rpartition("_")[0], f"{name.rpartition('_')[0]}_m"} & set(words))


def facts_of(wam):
    """Those of a WAM all of whose joints move."""
    ones = np.ones(7)
    motors = np.array(load_arm_file("wam7.yaml").transmission.motor_from_joint)
    moved = (ones > 0, 0 * ones, 50 * ones, 60.0, True, True)
    return ArmFacts(chain_of(wam.arm.robot), wam.delta, motors, *moved)


@pytest.mark.parametrize("name", catalogue())
def test_an_equation_holds_the_parameters_by_their_names(name, wam):
    effect = catalogue()[name]
    found = effect.candidates(facts_of(wam))
    shapes = {p.name for p in effect.nonlinear if p.is_parameter}
    names = shapes | {c.name for candidate in found for c in candidate.coefficients}
    assert [n for n in names if not in_equation(n, effect.equation)] == []
    for candidate in found:
        equation = effect.equation_of(candidate)
        told = shapes | {c.name for c in candidate.coefficients}
        assert [n for n in told if not in_equation(n, equation)] == []


def test_forms_that_have_the_same_coefficients_have_equations_of_their_own(wam):
    """Else two sizes of one effect, of two loads, read as a contradiction."""
    for name in "load_dependent_friction", "presliding", "torque_ripple":
        effect = catalogue()[name]
        forms = {c.variant: effect.equation_of(c) for c in effect.candidates(facts_of(wam))}
        assert len(set(forms.values())) == len(forms) > 1


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_so_do_those_of_servos(kind):
    assert all(in_equation(n, kind.equation) for n in kind.reported)
