"""A run is not lost where its semidefinite program is: the entropic fit needs none."""

from chain_arm import Experiment

from ident.estimation import least_squares
from ident.workflows.run import run_data
from wamctl.arm.errors import DataError


def unsolved(*_):
    raise DataError("The feasible fit ends outside of what is possible.")


def test_the_links_are_those_of_an_entropic_fit_and_it_is_said(monkeypatch):
    log = Experiment(joints=2, seconds=20.0).log()
    arm = log.arm()
    right = run_data(arm, [log.dataset(arm)]).content
    monkeypatch.setattr(least_squares, "feasible", unsolved)
    found = run_data(arm, [log.dataset(arm)]).content

    (remark,) = [r for r in found["remarks"] if r["code"] == "no_fit"]
    assert remark["sentence"].startswith(
        "The feasible fit ends outside of what is possible: the links are those of an entropic fit."
    )
    assert (right["verdict"], found["verdict"]) == ("trustworthy", "doubtful")
    error, least = (c["estimators"]["feasible"]["relative_error_percent"] for c in (found, right))
    assert error < 1.5 * least + 0.5
