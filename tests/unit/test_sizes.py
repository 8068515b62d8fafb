"""A reader finds each step on a few screens: files, functions and folders stay small."""

import ast
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
PACKAGES = ("wamctl", "ident", "sim_bus")
SOURCES = sorted(p for name in PACKAGES for p in (PROJECT / name).rglob("*.py"))
LINES, LINES_OF_FUNCTION, ARGUMENTS, MODULES = 350, 80, 8, 16
CATALOGUES = {"ident/effects"}  # one file an effect


def lines(path):
    return len(path.read_text(encoding="utf-8").splitlines())


def functions(source):
    tree = ast.parse(source.read_text(encoding="utf-8"))
    return [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]


def arguments(function):
    found = function.args
    names = [a.arg for a in (*found.posonlyargs, *found.args, *found.kwonlyargs)]
    return len(names) - ("self" in names)


def test_no_file_is_long():
    files = (*SOURCES, *(PROJECT / "scripts").rglob("*.py"))
    assert {str(p): n for p in files if (n := lines(p)) > LINES} == {}


def test_no_folder_holds_many_modules():
    counts = {p: len(list(p.glob("[!_]*.py"))) for p in {s.parent for s in SOURCES}}
    many = {str(p.relative_to(PROJECT)) for p, count in counts.items() if count > MODULES}
    assert many <= CATALOGUES


@pytest.mark.parametrize("package", PACKAGES)
def test_no_function_is_long_or_takes_many_arguments(package):
    sources = [s for s in SOURCES if s.is_relative_to(PROJECT / package)]
    found = [(s, f) for s in sources for f in functions(s)]
    long = [f.name for _, f in found if (f.end_lineno or 0) - f.lineno >= LINES_OF_FUNCTION]
    many = [f.name for _, f in found if arguments(f) > ARGUMENTS]
    assert (long, many) == ([], [])
