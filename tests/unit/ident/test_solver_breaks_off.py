"""A solver that breaks off in the middle of its work is a fit without a solution."""

from types import SimpleNamespace

import clarabel
import numpy as np
import pytest

from ident.estimation.conic import Inside, solve
from wamctl.arm.errors import DataError

PanicException = type("PanicException", (BaseException,), {})
"""As the solver's own, which derives from nothing else and cannot be imported."""


def asked(monkeypatch, answers: list):
    """A program whose runs end as the answers say."""

    class Solver:
        def __init__(self, *_) -> None:
            pass

        def solve(self):
            answer = answers.pop(0)
            if isinstance(answer, BaseException):
                raise answer
            return answer

    monkeypatch.setattr(clarabel, "DefaultSolver", Solver)
    return solve(np.eye(2), np.zeros(2), Inside([], np.zeros((0, 2)), np.zeros(0)), "The fit")


def test_it_is_tried_again_without_its_scaling(monkeypatch):
    found = SimpleNamespace(x=[1.0, 2.0], z=[], status="Solved")
    np.testing.assert_array_equal(asked(monkeypatch, [PanicException(), found]).x, found.x)


def test_twice_is_told_in_a_sentence(monkeypatch):
    with pytest.raises(DataError, match="The fit has no solution"):
        asked(monkeypatch, [PanicException(), PanicException()])


def test_a_user_who_interrupts_is_heard(monkeypatch):
    with pytest.raises(KeyboardInterrupt):
        asked(monkeypatch, [KeyboardInterrupt()])
