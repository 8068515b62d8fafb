"""Benchmarks and examples import only names that there are: nothing else of the suite runs them."""

import ast
import importlib
import importlib.util
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts"
OWN = {"ident", "sim_bus", "wamctl"}


def imported(script: Path) -> list[tuple[str, str]]:
    """Module of this project, and name in it."""
    return [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(script.read_text("utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in OWN
        for alias in node.names
    ]


@pytest.mark.parametrize("script", sorted(SCRIPTS.rglob("*.py")), ids=lambda p: p.name)
def test_what_a_script_imports_is_there(script):
    missing = [
        f"{module}.{name}" for module, name in imported(script) if not is_there(module, name)
    ]
    assert missing == []


def is_there(module: str, name: str) -> bool:
    found = importlib.import_module(module)
    if hasattr(found, name):
        return True
    return hasattr(found, "__path__") and importlib.util.find_spec(f"{module}.{name}") is not None
