"""Stops that go wrong: motors that turn the other way, bugs in the loop, waits without end."""

import re
import sys

import numpy as np
import pinocchio as pin
import pytest
from ideal_arm import PERIOD_S, Rig

from wamctl.errors import StopError
from wamctl.experiment.loop import Loop


def reversed_motor(motor, after):
    """The motor gives the opposite torque from a cycle on."""

    def reverse(rig):
        def motors(tau):
            if rig.drives.cycle < after:
                return tau
            return np.where(np.arange(7) == motor, -tau, tau)

        return motors

    return reverse


@pytest.mark.parametrize("motor", range(7))
@pytest.mark.parametrize("after", [400, 700, 900])
def test_braking_that_makes_the_arm_faster_is_cut_short(wam, motor, after):
    rig = Rig(wam)
    rig.drives.motors = reversed_motor(motor, after)(rig)
    speeds = []
    stopped_at = None

    def remember(cycle, readings):
        nonlocal stopped_at
        speeds.append(rig.drives.speed)
        if rig.loop.phase.word in ("brake", "cut off") and stopped_at is None:
            stopped_at = len(speeds) - 1
        return readings

    rig.drives.accident = remember
    rig.stopped()
    assert stopped_at is not None
    at_stop = max(speeds[stopped_at - 1], 0.5)
    assert max(speeds[stopped_at:]) < 1.2 * at_stop


def test_the_sentence_tells_what_braking_left(wam):
    rig = Rig(wam)
    rig.drives.motors = reversed_motor(3, 700)(rig)
    stop = rig.stopped()
    assert re.search(
        r"braking was cut short with \d\.\d\d rad/s and \d\.\d\d\d J left \(braking made the arm "
        r"faster: \S+ comes to \d\.\d\d rad/s \(limit \d\.\d\d rad/s\)\) and the drives were",
        stop.outcome,
    )


@pytest.mark.parametrize("motor", [1, 2])
def test_a_motor_that_does_not_move_as_it_is_driven_is_not_braked_by(wam, motor):
    """Nor is the other one of its differential; both are silent when the stop is told."""
    rig = Rig(wam)
    rig.drives.motors = reversed_motor(motor, 700)(rig)
    stop = rig.stopped()
    assert stop.cause.startswith(f"motor {motor + 1} does not move as it is driven")
    told = round(stop.at_s / PERIOD_S)
    sent = np.array(rig.drives.sent)
    assert sent[told - 2, [1, 2]].all()
    assert not sent[told - 1 :, [1, 2]].any()
    assert sent[told, [0, 3, 4, 5, 6]].all()


def stopped_by_the_operator(wam, cycle):
    rig = Rig(wam, lambda: "the operator pressed a key" if rig.drives.cycle >= cycle else None)
    return rig


@pytest.mark.parametrize("cycle", [500, 700, 900])
def test_an_arm_that_carries_more_than_it_knows_is_braked_and_not_let_go(wam, cycle):
    """What held the load in motion holds it while the arm is braked."""
    rig = stopped_by_the_operator(wam, cycle)
    hand = rig.drives._model.getFrameId(wam.file.limits.tool_frame)
    frame = rig.drives._model.frames[hand]
    load = pin.Inertia.FromSphere(1.0, 0.03)
    rig.drives._model.appendBodyToJoint(frame.parentJoint, load, frame.placement)
    rig.drives._data = rig.drives._model.createData()
    assert "the arm was braked for 0.08 s" in rig.stopped().outcome


def test_the_arm_is_braked_from_the_cycle_of_the_stop_on(wam):
    rig = stopped_by_the_operator(wam, 700)
    rig.loop.cycle = lambda *_, cycle=rig.loop.cycle: (
        pytest.fail("a cycle without torque") if len(rig.drives.sent) < rig.drives.cycle else None,
        cycle(*_),
    )[1]
    rig.stopped()


def test_nothing_is_braked_before_its_motors_are_tested(wam):
    rig = Rig(wam, tests_motors=True)
    rig.drives.motors = reversed_motor(6, 0)(rig)
    stop = rig.stopped()
    assert stop.cause.startswith("velocity of joint 7")
    assert stop.outcome == "the drives were disabled"


def test_the_operator_can_stop_the_arm_while_it_is_released(wam):
    rig = Rig(wam, lambda: "the operator pressed a key" if rig.loop.phase.word == "release" else "")
    assert rig.stopped().cause == "the operator pressed a key"


def test_a_release_that_falls_is_stopped(wam):
    rig = Rig(wam)
    falling = wam.control.__class__.release
    wam_release = lambda self, q, qd, held: falling(self, q, 0.0 * qd, held) * 0.0  # noqa: E731
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wam.control.__class__, "release", wam_release)
        stop = rig.stopped()
    assert stop.phase == "release"
    assert stop.cause.startswith(("velocity of joint", "speed of", "position of", "kinetic"))


class InjectedError(Exception):
    """A bug that the test puts into the loop."""


class Injector:
    """Raises at the given line of a cycle, in `Loop._cycle`."""

    def __init__(self, cycle, line):
        self.left, self.cycle, self.seen = line, cycle, 0

    def on_call(self, frame, event, argument):
        inside = frame.f_code is Loop._cycle.__code__
        if inside:
            self.seen += 1
        return self.on_line if inside and self.seen == self.cycle else None

    def on_line(self, frame, event, argument):
        if event == "line":
            self.left -= 1
            if self.left < 0:
                raise InjectedError
        return self.on_line


@pytest.mark.parametrize("line", range(16))
def test_a_bug_at_any_line_of_a_cycle_takes_torque_away_at_once(wam, line):
    rig = Rig(wam)
    injector, before = Injector(cycle=600, line=line), sys.gettrace()
    sys.settrace(injector.on_call)
    try:
        with pytest.raises((InjectedError, StopError)):
            rig.run()
    finally:
        sys.settrace(before)
    if injector.left < 0:
        assert rig.drives.is_quiet
        assert rig.drives.cycle <= 600
