"""Which effects count as rivals: their lead, and where it comes from."""

import numpy as np
import pytest

from ident.effects.candidate import Candidate, Coefficient, NoParameters
from ident.gap.regression.model_columns import ModelStructure
from ident.gap.regression.weighted_fit import Fit
from ident.gap.selection.rivals import cannot_tell, told_apart
from ident.gap.selection.scoring import Score
from ident.gap.selection.state import AcceptedEffect
from ident.gap.settings import GapSettings

ROWS = np.array([[500, 500, 0]])  # of one joint: at reversals, while it slides, at shared motors'
INDEPENDENT = np.array([500.0])


def fitted(turning: float = 0.0, sliding: float = 0.0) -> Fit:
    """A fit that gains so many nats per sample in each region."""
    sigma = np.exp(-np.array([[turning, sliding, 0.0]]) * ROWS.sum() / 500)
    return Fit(ModelStructure(np.zeros((1, 1))), np.ones(1), sigma, ROWS, np.eye(1))


def score(effect: str, turning: float, sliding: float) -> Score:
    candidate = Candidate(effect, (0,), (0,), (Coefficient("size", "N m"),), NoParameters())
    fit = fitted(turning, sliding)
    gain = fit.gain_over(fitted())
    return Score(0, candidate, fit, gain, gain)


@pytest.mark.parametrize(
    ("leader", "rival", "told"),
    [
        (("torque_delay", 0.018, 0.092), ("rotor_inertia", 0.0, 0.080), False),
        (("torque_delay", 0.018, 0.130), ("rotor_inertia", 0.0, 0.100), True),
        (("torque_delay", 0.130, 0.020), ("rotor_inertia", 0.09, 0.020), True),
        (("torque_delay", 0.018, 0.130), ("rotor_inertia", 0.02, 0.126), False),
    ],
    ids=["leads where it turns back", "leads while sliding", "shows where it turns back", "level"],
)
def test_what_shows_while_a_joint_slides_has_to_lead_its_lookalikes_there(leader, rival, told):
    first, second = score(*leader), score(*rival)
    assert first.gain - second.gain == pytest.approx(sum(leader[1:]) - sum(rival[1:]))
    found = cannot_tell(first, second, fitted(), INDEPENDENT, GapSettings().rivals)
    assert found is not told


def test_what_the_model_names_is_no_rival_in_it():
    """A delay was named, and "it may also be a delay" said of a rotor beside it."""
    names = "torque_delay", "rotor_inertia", "joint_spring"
    delay, rotor, spring = (score(n, 0.0, 0.1) for n in names)
    accepted = [
        AcceptedEffect(delay, (0,), np.zeros(1), (), rivals=(rotor, spring)),
        AcceptedEffect(rotor, (0,), np.zeros(1), (), rivals=(delay,)),
    ]
    told = [[r.candidate.effect for r in a.rivals] for a in told_apart(accepted)]
    assert told == [["joint_spring"], []]
    assert [a.score for a in told_apart(accepted)] == [delay, rotor]
