"""What arms borrow from their type: smaller standard errors, and intervals that hold."""

from dataclasses import dataclass

import numpy as np
import pytest

from ident.fleet.arm_type import ArmType
from ident.fleet.columns import Name
from ident.fleet.hierarchy import TypeStatistics, learned, log_information, louder
from ident.fleet.normal import LogData, nothing, posterior
from ident.fleet.triangles import of_rows
from ident.regression.triangles import triangle

P = 8
NAMES = (*(Name(f"x{k}", "kg m", "inertial", 1) for k in range(P - 1)), Name("fc1", "N m", "fc", 1))
KIND = ArmType("made", NAMES, ("joint",), np.zeros(P), np.zeros((P, 10)))
MEAN, SPREAD = np.linspace(1.0, 3.0, P), 0.1
DAILY, NOISE = 0.02, 0.5
SEEN = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.15, 0.1, 1.0])  # the motion hardly shows two of them
WORST = SEEN < 0.5
LEVEL = 1.645  # of an interval that holds 90 %


def arm(rng, days, noise=NOISE) -> tuple[np.ndarray, list[LogData]]:
    """An arm's parameters, and its logs."""
    x, logs = MEAN + SPREAD * rng.standard_normal(P), []
    for _ in range(days):
        today = x + DAILY * rng.standard_normal() * np.eye(P)[-1]
        X = SEEN * rng.standard_normal((120, P))
        rows = np.column_stack([X, X @ today + noise * rng.standard_normal(120)])
        logs.append(LogData([of_rows(0, triangle(rows))], [120], 1.0))
    return x, logs


@dataclass(frozen=True)
class Judged:
    truth: np.ndarray
    own: np.ndarray
    helped: np.ndarray
    values: np.ndarray


@pytest.fixture(scope="module")
def known() -> TypeStatistics:
    """A type that twenty arms have taught."""
    rng = np.random.default_rng(0)
    return learned([arm(rng, 5)[1] for _ in range(20)], KIND, 24.0, 15)


@pytest.fixture(scope="module")
def judged(known) -> Judged:
    """Sixty arms by one log each, with and without the type."""
    rng = np.random.default_rng(1)
    cases = []
    for _ in range(60):
        x, logs = arm(rng, 1)
        own = _posterior(logs, known, 1e6)[1]
        values, helped = _posterior(logs, known, 1.0)
        cases.append((x, own, helped, values))
    return Judged(*(np.array(c) for c in zip(*cases, strict=True)))


def _posterior(logs, known: TypeStatistics, wider: float):
    said = nothing(P)
    for log in louder(logs, known.own):
        said = said + log_information(log, KIND, known)
    x, V = posterior(said, known.mean, wider * known.D)
    return x, np.sqrt(np.diag(V))


def test_the_type_halves_what_a_fifth_of_the_motion_leaves_open(judged):
    ratios = np.median(judged.helped / judged.own, axis=0)
    assert (ratios[WORST] < 0.5).all()
    assert (ratios <= 1.0).all()


def test_intervals_that_borrow_from_the_type_hold_the_truth(judged):
    inside = np.abs(judged.values - judged.truth) <= LEVEL * judged.helped
    assert 0.84 < inside.mean() < 0.96  # 480 values, but those of an arm depend on each other
    assert inside[:, WORST].mean() > 0.84


def test_an_arm_that_is_louder_than_its_type_is_less_sure(known):
    """As if it were as quiet as the type, its errors would be four times the variance told."""
    rng, squares = np.random.default_rng(2), []
    for _ in range(40):
        x, logs = arm(rng, 3, 2 * NOISE)
        values, sds = _posterior(logs, known, 1e6)
        squares.append(((values - x) / sds)[:-1] ** 2)
    assert 0.6 < np.mean(squares) < 1.5
