"""The experiment on a classic arm while something goes wrong: a defined stop and its sentence."""

import re

import numpy as np
import pytest

from tests.bus.buses import on_buses, on_embedded_bus
from wamctl.errors import BusStopError, SafetyStopError

EXCITE = {"after": "enabled", "cycles": 300}
"""In the middle of the motion."""

FAULTS = [
    (
        {"fault": "dead_drive", "node": 3},
        BusStopError,
        r"no position from Puck 3 \(node 3\) in 8 cycles \(limit 8\)",
        0.05,
    ),
    (
        {"fault": "pendant", "button": "idle"},
        BusStopError,
        "safety module went to IDLE, since Shift-Idle was pressed on the pendant",
        0.01,
    ),
    (
        {"fault": "pendant", "button": "estop"},
        BusStopError,
        "E-STOP: the safety module has cut the power of all motors",
        0.01,
    ),
    (
        {"fault": "safety_fault", "light": "torque"},
        BusStopError,
        "safety module fell back to IDLE with a fault of torque",
        0.01,
    ),
    (
        {"fault": "safety_fault", "light": "velocity"},
        BusStopError,
        "safety module fell back to IDLE with a fault of velocity",
        0.01,
    ),
    (
        {"fault": "lost_zero"},
        BusStopError,
        r"safety module lost the arm's zero \(ZERO = 0\)",
        0.3,
    ),
    (
        {"fault": "encoder_jump", "node": 2, "counts": 1000},
        SafetyStopError,
        r"position of motor 2 jumped by 1\.5\d\d rad in 2\.0 ms \(limit 0\.\d\d\d rad\)",
        0.01,
    ),
    (
        {"fault": "doubled_frames", "id": 0x443, "number": 10_000},
        BusStopError,
        r"two positions at once from Puck 2 \(node 2\) in 8 cycles \(limit 8\)",
        0.05,
    ),
    (
        {"fault": "bus_off", "node": "host"},
        BusStopError,
        r"bus \S+:\S+ went bus-off",
        0.15,
    ),
]


def test_nothing_goes_wrong_but_three_lost_frames(experiment):
    ids = (0x404, 0x401, 0x463)
    lost = [{"fault": "lost_frames", "id": i, "after": "enabled", "cycles": i} for i in ids]
    outcome = experiment(*lost)
    assert outcome.stop is None
    assert len(outcome.recording.stamp_ns) > 1000
    assert outcome.recording.command is not None
    assert np.abs(outcome.recording.command.effort).max() > 5.0


@on_buses(
    "bus_word",
    ("fault", "kind", "cause", "within_s"),
    FAULTS,
    lambda case: case[0]["fault"] in ("bus_off", "dead_drive"),
)
def test_a_fault_in_the_middle_of_the_motion(experiment, fault, kind, cause, within_s):
    outcome = experiment(fault | EXCITE)
    assert type(outcome.stop) is kind
    assert re.fullmatch(cause, outcome.stop.cause)
    assert outcome.stop.phase == "excite"
    assert "the drives " in outcome.stop.outcome
    assert not outcome.seen[-1][1]
    assert -0.002 <= outcome.quiet_after_s() <= within_s
    rows = int(re.search(r"holds (\d+) cycles", str(outcome.stop))[1])
    assert len(outcome.recording.stamp_ns) == rows


@on_embedded_bus("bus_word")
def test_the_pendant_before_the_arm_is_enabled(experiment):
    outcome = experiment(
        {"fault": "pendant", "button": "estop", "after": "first_cycle", "cycles": 3}
    )
    assert type(outcome.stop) is BusStopError
    assert outcome.stop.phase == "enable"
    assert not any(units for _, _, units in outcome.seen)


@on_embedded_bus("bus_word")
@pytest.mark.parametrize(
    "fault", [{"fault": "pendant", "button": "idle"}, {"fault": "safety_fault", "light": "torque"}]
)
def test_idle_takes_nothing_away_while_the_arm_waits_for_the_pendant(experiment, fault):
    outcome = experiment(fault | {"after": "first_cycle", "cycles": 3})
    assert outcome.stop is None
    assert len(outcome.recording.stamp_ns) > 1000


@on_embedded_bus("bus_word")
def test_idle_right_behind_activation(experiment):
    """The module has said that it is ACTIVE, and not all Pucks that they have followed."""
    fault = {"fault": "pendant", "button": "idle", "after": "enabled", "cycles": 1}
    outcome = experiment(fault)
    assert type(outcome.stop) is BusStopError
    cause = "safety module went to IDLE, since Shift-Idle was pressed on the pendant"
    assert outcome.stop.cause == cause
    assert outcome.stop.phase == "enable"
