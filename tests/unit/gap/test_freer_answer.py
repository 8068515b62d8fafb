"""A measured curve beside an effect: it predicts better where the form is another, and only there.

The arm and its hidden torques are simulated; another motion than the fitted one is predicted.
"""

import numpy as np
import pytest
from closed_loop import recorded, source_of, wam

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.data.windows import windows_for
from ident.gap.options import Options
from ident.planning.hypotheses import UNKNOWN, Answer, Hypothesis, hypotheses, name_of, unsettled
from ident.planning.known import log_likelihood, predictions
from ident.planning.noise import stretches
from ident.simulation.arm import SimulatedArm, Term, term
from wamctl.investigation.decision import REFUTED
from wamctl.investigation.evidence import signed_evidence


@term
def hose(t, q, qd, load, joint, settings, resistance, level):
    """A hose that is bent twice over the joint's range."""
    resistance[joint] += settings[0] * np.sin(2.0 * q[joint])


@term
def cubic(t, q, qd, load, joint, settings, resistance, level):
    """A spring that is slack at first."""
    resistance[joint] += settings[0] * (q[joint] - settings[1]) ** 3


@term
def rubbing(t, q, qd, load, joint, settings, resistance, level):
    """Friction that is larger at one end of the joint's range."""
    level[joint] += settings[0] * np.sin(2.0 * q[joint])


SPRING = catalogue()["joint_spring"].at((3,))
HIP = catalogue()["joint_spring"].at((1,))
STRIBECK = catalogue()["stribeck"]
STICKING = STRIBECK.at((3,), STRIBECK.Parameters(0.1, 1.0))


def answers(arm: SimulatedArm, effect: Candidate) -> dict[str, Hypothesis]:
    """What is fitted where an effect leads."""
    answer = Answer({"verdict": "unknown", "effects": [], "suspected": []}, (effect,))
    found = hypotheses(source_of(recorded(arm)), answer, Options(), lambda _: None)
    return {h.name: h for h in found}


def evidence(found: dict[str, Hypothesis], arm: SimulatedArm, joint: int, name: str) -> float:
    """Of the curve over an answer, on a motion of the joint alone [nats]."""
    data = source_of(recorded(arm, moving=(joint,))).datasets[0]
    noise, motion = found[name].noise, stretches(data)
    windows = windows_for(data.rate_hz, noise.cutoff_hz)
    told = {}
    for n in (UNKNOWN, name):
        seen = predictions(found[n].model, found[n].known, noise, data, motion)
        told[n] = log_likelihood(seen, found[n].known, windows).sum(axis=1)
    return signed_evidence([(told[UNKNOWN] - told[name]).tolist()])


@pytest.mark.parametrize(
    ("effect", "other"),
    [
        pytest.param(HIP, Term(hose, 1, (2.0,)), marks=pytest.mark.thorough, id="hose"),
        pytest.param(STICKING, Term(rubbing, 3, (1.0,)), id="friction by position"),
    ],
)
def test_a_curve_refutes_an_effect_of_another_form(effect, other):
    arm = wam(other)
    found = answers(arm, effect)
    assert evidence(found, arm, effect.joints[0], name_of([effect])) > REFUTED


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        pytest.param(SPRING, [1.2, -0.4], id="spring", marks=pytest.mark.thorough),
        pytest.param(STICKING, [0.9], id="stribeck"),
    ],
)
def test_a_curve_does_not_refute_an_effect_of_the_catalogues_form(effect, values):
    arm = catalogue()[effect.effect].simulated(wam(), effect, np.array(values))
    found = answers(arm, effect)
    assert evidence(found, arm, effect.joints[0], name_of([effect])) < REFUTED
    assert unsettled(list(found.values())) == [
        h for h in found if h not in ("none", "unknown") and not h.endswith(":4")
    ]


@pytest.mark.thorough
def test_a_spring_that_a_hardening_one_replaces_beside_other_links_is_unsettled():
    found = answers(wam(Term(cubic, 1, (0.12, 0.0))), HIP)
    assert "joint_spring:2" in unsettled(list(found.values()))


def test_the_curve_stands_at_the_joint_of_what_leads():
    arm = STRIBECK.simulated(wam(Term(hose, 1, (0.5,))), STICKING, np.array([0.9]))
    no_gap, source = Answer({"verdict": "no_gap", "effects": []}, ()), source_of(recorded(arm))

    def places(lead: str | None) -> dict[str, tuple[int, ...]]:
        found = hypotheses(source, no_gap, Options(), lambda _: None, lead)
        return {h.name: h.model.effects.records[-1].joints for h in found if h.name != "none"}

    before = places(None)
    other = next(name for name, joints in before.items() if not {*before[UNKNOWN]} & {*joints})
    after = places(other)
    assert set(after[UNKNOWN]) <= set(after[other])
