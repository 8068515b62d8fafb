"""One effect-free recording and one with a hidden effect, searched once for all tests."""

import pytest
from closed_loop import bump, recorded, source_of, wam

from ident.gap.data.experiment import Experiment
from ident.gap.options import Options
from ident.gap.results.outcome import SearchResult
from ident.gap.search import search
from ident.simulation.arm import Term
from wamctl.arm.recording import Recording


@pytest.fixture(scope="session")
def plain() -> Recording:
    return recorded(wam())


@pytest.fixture(scope="session")
def source(plain) -> Experiment:
    return source_of(plain)


@pytest.fixture(scope="session")
def nothing_hidden(source) -> SearchResult:
    return search(source, Options(null_runs=1), lambda _: None)


@pytest.fixture(scope="session")
def bumpy() -> Recording:
    return recorded(wam(Term(bump, 3, (2.0, 1.6, 0.12))))
