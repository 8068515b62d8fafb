"""A search whose solver fails, or whose joints never slide, still has a result."""

from dataclasses import replace

import numpy as np
import pytest

from ident.gap.lack_of_fit.remaining_structure import remaining_structures, structureless_noise
from ident.gap.regression import feasible_fit as module
from ident.gap.settings import EffectFreeData, LackOfFit
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import pseudo_inertia
from wamctl.arm.robot import cad_parameters


def fails(*_):
    raise DataError("The feasible fit gives up (PrimalInfeasible).")


@pytest.fixture
def fitted(nothing_hidden, monkeypatch):
    monkeypatch.setattr(module, "feasible", fails)
    found = nothing_hidden
    return lambda: module.feasible_fit(
        found.source, found.start.fit, len(found.rows.base_parameters)
    )


def test_without_the_semidefinite_program_the_links_are_possible_all_the_same(fitted):
    arm = fitted()
    assert arm.note == (
        "The feasible fit gives up (PrimalInfeasible): the links are those of an entropic fit."
    )
    for link in arm.inertial.reshape(-1, 10):
        assert np.linalg.eigvalsh(pseudo_inertia(link)).min() > 0.0


def test_without_any_fit_the_links_are_those_of_cad(fitted, nothing_hidden, monkeypatch):
    monkeypatch.setattr(module, "entropic_path", fails)
    arm = fitted()
    assert arm.note.endswith("the links are those of the CAD model.")
    assert arm.inertial == pytest.approx(cad_parameters(nothing_hidden.source.arm.robot))


def test_joints_that_never_slide_have_no_structure(nothing_hidden):
    still = replace(nothing_hidden.start.model, slow=np.full(7, 100.0))
    current = replace(nothing_hidden.start, model=still)
    assert remaining_structures(nothing_hidden.rows, current, LackOfFit()) == []
    assert len(structureless_noise(nothing_hidden.rows, current, EffectFreeData())) == 7
