"""Evidence between answers that were written down before a motion."""

import math

import numpy as np
import pytest

from wamctl.investigation.evidence import (
    SEARCH_NATS,
    asked,
    log_evidence,
    odds,
    odds_text,
    signed_evidence,
)

JOINTS = 3


def played(rng: np.random.Generator, apart: float, blocks: int) -> list[float]:
    """Ratios of an answer that is `apart` from the truth, the rival is the truth; heavy tails."""
    residual = rng.standard_t(3, size=(blocks, JOINTS)) * np.exp(rng.normal(size=(blocks, 1)))
    wrong = residual - apart * rng.normal(size=(blocks, JOINTS))
    return ((residual**2 - wrong**2).sum(axis=1) / 2.0).tolist()


def in_motions(blocks: list[float]) -> list[list[float]]:
    """Motions of twenty blocks each."""
    return [blocks[k : k + 20] for k in range(0, len(blocks), 20)]


@pytest.mark.parametrize(
    "apart", [0.5, *(pytest.param(x, marks=pytest.mark.thorough) for x in (0.0, 0.05, 20.0))]
)
def test_a_wrong_leader_is_confirmed_no_more_often_than_promised_although_looked_at_always(apart):
    rng, alpha, runs = np.random.default_rng(1), 0.05, 2000
    bar = np.log(1 / alpha)
    crossed = 0
    for _ in range(runs):
        blocks = played(rng, apart, 60)
        told = [log_evidence(in_motions(blocks[:k])) for k in range(1, 61)]
        crossed += max(told) > bar
    assert crossed / runs < alpha


def test_a_right_leader_is_confirmed_soon():
    rng = np.random.default_rng(2)
    right = [-b for b in played(rng, 3.0, 40)]
    assert log_evidence([right]) > asked(0.01, 1)
    assert signed_evidence([[-b for b in right]]) < -asked(0.01, 1)


def test_a_prediction_that_failed_early_does_not_outweigh_later_ones_for_ever():
    rng = np.random.default_rng(4)
    failed, right = played(rng, 3.0, 40), [-b for b in played(rng, 3.0, 40)]
    assert log_evidence([failed]) > -asked(0.01, 1)
    assert log_evidence([failed, right]) > asked(0.01, 1)


def test_later_leaders_must_show_more():
    spent = [np.exp(-asked(0.01, k)) for k in range(1, 40)]
    assert sum(spent) == pytest.approx(0.01)
    assert spent == sorted(spent, reverse=True)


def test_blocks_that_both_predict_alike_decide_nothing():
    assert log_evidence([[0.0] * 4]) == pytest.approx(0.0)


def test_an_effect_of_a_third_of_the_noise_is_confirmed_within_a_motion():
    rng, rows = np.random.default_rng(3), 30  # of a block of 1.5 s
    effect = rng.normal(size=(46, rows)) / 3.0
    residual = rng.normal(size=effect.shape)
    ratios = (((residual + effect) ** 2 - residual**2) / 2.0).sum(axis=1)
    assert log_evidence([ratios.tolist()]) > asked(0.01, 2)


def test_a_search_of_the_same_data_counts_twenty_to_one():
    searched = {"none": 0.0, "unknown": 0.0, "stribeck:4": SEARCH_NATS}
    assert odds(searched, {})["stribeck:4"] == pytest.approx(20.09 / 22.09, abs=0.01)
    later = odds(searched, {("stribeck:4", "none"): [[2.0] * 12]})
    assert later["none"] < 1e-3
    assert sum(later.values()) == pytest.approx(1.0)


def test_no_prediction_counts_between_answers_that_the_search_cannot_tell_apart():
    alike = "delay:7", "rotor:7"
    searched = {"none": 0.0, "unknown": 0.0} | dict.fromkeys(alike, SEARCH_NATS)
    found = odds(searched, {alike: [[2.0] * 10], (alike[0], "none"): [[2.0] * 10]}, alike)
    assert found["delay:7"] == pytest.approx(found["rotor:7"])
    assert (found["delay:7"] > 0.45, found["none"] < 1e-3) == (True, True)


def test_what_the_search_does_not_see_counts_at_most_as_much_as_the_search():
    searched = {"none": SEARCH_NATS, "unknown": 0.0}
    pairs = {("none", "backlash:3"): [[-5.0] * 20]}
    unseen = odds(searched, pairs)
    assert unseen["backlash:3"] == pytest.approx(unseen["none"])
    assert odds(searched | {"backlash:3": 0.0}, pairs)["backlash:3"] > 0.999


@pytest.mark.parametrize(
    ("nats", "text"),
    [
        (math.log(200.0), "200 to 1"),
        (math.log(1.5), "1.5 to 1"),
        (-math.log(3.0), "1 to 3.0"),
        (40.0, "more than 1,000,000 to 1"),
        (-40.0, "1 to more than 1,000,000"),
    ],
)
def test_evidence_is_told_as_odds(nats: float, text: str) -> None:
    assert odds_text(nats) == text
