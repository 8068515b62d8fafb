"""Signs of torque that one recording alone does not tell."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from wrong_inputs import on_one_line, right, scaled, turned

from ident.checks import signs
from ident.checks.examine import examine
from ident.checks.remark import Grade
from ident.checks.settings import DEFAULT


def signs_of(*logs):
    arm = logs[0].arm()
    found = examine(arm, [log.dataset(arm, f"log {k}") for k, log in enumerate(logs)])
    ratios = []
    for log, mended in zip(logs, found.data, strict=True):
        (_, part), *_ = mended.read()
        ratios.append(np.sign(part.tau[len(part.tau) // 2] / log.tau[len(log.tau) // 2]).tolist())
    return ratios, [r for r in found.remarks if r.code == "sign"]


def examined(log):
    arm = log.arm()
    return examine(arm, [log.dataset(arm)]).remarks


def hidden(log, joint):
    """The joint's torque drowned in noise, which leaves its sign open."""
    noise = np.random.default_rng(1).normal(size=len(log.tau))
    tau = log.tau.copy()
    tau[:, joint] += 30 * np.abs(tau[:, joint]).max() * noise
    return log.with_(tau=tau)


def test_recordings_of_one_arm_have_its_signs():
    """What is inverted in the recording that tells it is inverted in the other one as well."""
    told = turned(2)
    assert signs_of(hidden(told, 2))[0] == [[1, 1, 1]]
    factors, remarks = signs_of(told, hidden(told, 2))
    assert factors == [[1, 1, -1], [1, 1, -1]]
    assert "as in the other recordings" in remarks[1].finding


def test_a_recording_that_was_truly_turned_round_is_turned_back_alone():
    factors, remarks = signs_of(right(), turned(1))
    assert factors == [[1, 1, 1], [1, -1, 1]]
    assert [r.joints for r in remarks] == [(2,)]


def test_a_drive_that_makes_up_for_viscous_friction_is_not_reversed():
    """Its Coulomb friction brakes; a reversed torque would reverse that, too."""
    log = right(friction=0.2)
    speed = np.gradient(log.q, log.t, axis=0)[:, 1]
    helped, size = log.tau.copy(), np.abs(log.tau[:, 1]).std() / speed.std()
    helped[:, 1] -= 2.0 * size * speed
    factors, remarks = signs_of(log.with_(tau=helped))
    assert factors == [[1, 1, 1]]
    assert remarks == []
    factors, _ = signs_of(log.with_(tau=log.tau * [1, -1, 1]))
    assert factors == [[1, -1, 1]]


class Coupled:
    """An arm whose joints 2 and 3 share a load: turning one of them alone may cost error."""

    robot = SimpleNamespace(dof=3, joint_names=("a", "b", "c"))

    def __init__(self, factors=(1.0, 1.0, 1.0), alone=0.5):
        self.factors, self.alone = np.array(factors), alone
        self.error = 0.1 if factors[1] == factors[2] else alone

    def with_torque(self, factors):
        return Coupled(self.factors * factors, self.alone)


@pytest.mark.parametrize("tells", [True, False])
def test_joints_that_share_a_load_are_turned_together_if_the_motion_tells_it(monkeypatch, tells):
    monkeypatch.setattr(signs, "feeding", lambda c, _: (c.factors > 0) & [False, True, True])
    monkeypatch.setattr(signs, "nearest", lambda c, tried: (tried[0], tried[0].without(c)))
    whole: Any = Coupled()
    _, factors, remarks = signs.feeding_turned(whole, tells, DEFAULT)
    assert factors.tolist() == ([1, -1, -1] if tells else [1, 1, 1])
    assert [r.joints for r in remarks] == ([(2, 3)] if tells else [(2,), (3,)])


def test_where_the_motion_tells_little_only_a_falling_error_turns_a_torque(monkeypatch):
    monkeypatch.setattr(signs, "feeding", lambda c, _: (c.factors > 0) & [False, True, False])
    monkeypatch.setattr(signs, "nearest", lambda c, tried: (tried[0], tried[0].without(c)))
    case: Any = Coupled(alone=0.1)
    _, factors, (remark,) = signs.feeding_turned(case, False, DEFAULT)
    assert factors.tolist() == [1, 1, 1]
    assert "Friction at joint 2 (b) would drive the motion" in remark.finding


def test_a_turn_that_explains_less_is_not_made(monkeypatch):
    """The fit of another joint's wrong torque may make a right joint's friction negative."""
    monkeypatch.setattr(signs, "feeding", lambda c, _: (c.factors > 0) & [False, True, False])
    monkeypatch.setattr(signs, "nearest", lambda c, tried: (tried[0], tried[0].without(c)))
    monkeypatch.setattr(signs, "position_sign", signs.torque_sign)
    case: Any = Coupled(alone=0.11)
    found, factors, (remark,) = signs.feeding_turned(case, True, DEFAULT)
    assert found is case
    assert factors.tolist() == [1, 1, 1]
    assert remark.finding == (
        "Friction at joint 2 (b) would drive the motion: the torque lags or leads the position, or"
        " another joint's is wrong; turned round, it is explained worse."
    )


@pytest.mark.parametrize(
    ("log", "grade"), [(right(), Grade.REFUSED), (on_one_line(0.001), Grade.DOUBTFUL)]
)
def test_a_size_refuses_no_recording_that_moves_as_one(log, grade):
    """The URDF's inertia may be what is wrong: this motion tells it from weight too little."""
    (remark,) = [r for r in examined(scaled(0.2, log)) if r.code == "units"]
    assert remark.grade == grade


def test_a_recording_that_moves_as_one_counts_no_joint_the_other_way_round():
    """Its position and torque are turned; by its motion that is an arm with other links."""
    log = on_one_line(0.001)
    turned_round = log.with_(q=log.q * [1, -1, 1], tau=log.tau * [1, -1, 1])
    assert [r.code for r in examined(turned_round)] == ["poor_motion"]
