"""Effects beside which an arm explains its own recordings worse are suspected only."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import recorded, source_of, sticking, wam

import ident.workflows.gap_outcome as module
from ident.gap.options import Options
from ident.gap.results.outcome import SearchResult
from ident.gap.results.verdict import Kind
from ident.gap.search import search
from ident.simulation.arm import Term
from ident.workflows.gap_outcome import beside_run, outcome_of, written_model


def silent(_: str) -> None:
    """Nobody listens."""


@pytest.fixture(scope="module")
def sticky() -> SearchResult:
    log = recorded(wam(Term(sticking, 3, (0.8, 0.05))), moving=(1, 3))
    return search(source_of(log), Options(null_runs=1), silent)


def test_effects_with_which_the_arm_explains_more_stay(sticky):
    outcome, written, told = beside_run(*written_model(outcome_of(sticky, silent), silent), silent)
    assert told == ()
    assert outcome.found is sticky
    assert [r.name for r in written.model.effects.records] == ["stribeck"]


@pytest.fixture
def worse(monkeypatch):
    monkeypatch.setattr(module, "worse_than_run", lambda *_: ([12.3], [7.4]))


def test_effects_that_explain_more_of_held_out_parts_stay(sticky, worse):
    """Without them, other parameters may fit a short motion better, and predict another worse."""
    outcome, _, told = beside_run(*written_model(outcome_of(sticky, silent), silent), silent)
    assert told == ()
    assert outcome.found is sticky


def test_effects_with_which_it_explains_less_are_withheld(sticky, worse):
    outcome, written = written_model(outcome_of(sticky, silent), silent)
    noisy = replace(written.model, noise=10.0 * np.asarray(written.model.noise))
    before = outcome, replace(written, model=noisy)
    outcome, written, (remark,) = beside_run(*before, silent)
    verdict = outcome.found.verdict
    assert (verdict.kind, verdict.effects) == (Kind.UNKNOWN, ())
    (apart,) = verdict.suspected
    assert apart.candidate.effect == "stribeck"
    assert not apart.in_model
    assert "worse" in apart.doubt
    assert len(written.model.effects.records) == 0
    assert "12.3 instead of 7.4 %" in remark.finding
    assert "nothing is named" in remark.finding
