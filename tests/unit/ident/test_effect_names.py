"""Nothing outside an effect's own file knows its name."""

import ast
from pathlib import Path

import ident
from ident.effects.catalogue import catalogue
from ident.model.arm import TERM_NAMES

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
