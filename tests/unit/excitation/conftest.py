"""The arm and its excitation problem, built once."""

from pathlib import Path

import numpy as np
import pytest

from ident.excitation.design import DesignTask, problem_of
from ident.excitation.problem.design_problem import Problem
from ident.excitation.settings import DesignSettings
from ident.workflows.design import place_of

ALL_TERMS = ("viscous", "coulomb", "offset", "rotor_inertia")


@pytest.fixture(scope="session")
def place() -> DesignTask:
    return place_of(Path("wam7.yaml"))


@pytest.fixture(scope="session")
def problem(place: DesignTask) -> Problem:
    return problem_of(place, DesignSettings())


@pytest.fixture(scope="session")
def full_problem(place: DesignTask) -> Problem:
    return problem_of(place, DesignSettings(terms=ALL_TERMS))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)
