"""The experiment with drives and a log of the test's own: every way to end."""

import numpy as np
import pytest
from ideal_arm import REST, Rig

from wamctl.drives.interface import Readings
from wamctl.errors import BusStopError, RefusalError
from wamctl.experiment import phases as experiment


@pytest.fixture
def rig(wam):
    return Rig(wam)


def test_a_whole_experiment(rig):
    assert rig.run() == 500
    assert rig.log.rows == rig.drives.cycle
    assert sorted(set(rig.log.phases)) == [1, 2, 3, 4, 5]
    assert rig.drives.is_quiet


def test_torque_is_zero_until_all_drives_are_enabled(wam, rig):
    rig.drives.obeys = False

    def wake(cycle, readings):
        rig.drives.obeys = cycle >= 20
        return readings

    rig.drives.accident = wake
    rig.run()
    assert not np.any(rig.drives.sent[:20])
    assert np.any(rig.drives.sent[22])


def test_drives_that_do_not_enable(rig):
    rig.drives.obeys = False
    stop = rig.stopped()
    assert isinstance(stop, BusStopError)
    assert str(stop) == (
        "not all drives were enabled within 0.1 s (drive 1 OFF, drive 2 OFF, drive 3 OFF, drive 4 "
        "OFF, drive 5 OFF, drive 6 OFF, drive 7 OFF), 0.098 s after the first SYNC in phase "
        "'enable': the drives were disabled."
    )


def at(cycle, change):
    return lambda now, readings: change(readings) if now >= cycle else readings


def changed(readings, **what):
    return Readings(**vars(readings) | what)


def test_a_drive_fault_disables_at_once(rig):
    rig.drives.accident = at(300, lambda r: changed(r, fault="drive 3 reported EMCY 0x2310"))
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (4, "drive 3 reported EMCY 0x2310")
    assert stop.outcome == "the drives were disabled"
    assert not rig.drives.sent[299].any()  # the torque frame of the very cycle


def test_a_stop_switch_brakes_first(rig):
    rig.drives.accident = at(300, lambda r: changed(r, stop="the stop switch was pressed"))
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (5, "the stop switch was pressed")
    assert stop.outcome.startswith("the arm was braked for 0.08 s with 0.08 rad/s and 0.001 J left")
    assert stop.outcome.endswith(" and the drives were disabled")
    assert rig.drives.cycle == 300 + 40 + 1


def test_the_operator_stops_the_arm(wam):
    rig = Rig(wam, lambda: "the operator pressed a key" if rig.drives.cycle >= 900 else None)
    stop = rig.stopped()
    assert str(stop) == (
        "the operator pressed a key, 1.798 s after the first SYNC in phase 'excite': the arm was "
        "braked for 0.08 s with 0.06 rad/s and 0.001 J left and the drives were disabled."
    )
    assert np.abs(rig.loop.state.qd).max() < 0.1


def test_missing_readings_are_borne_for_a_while(wam, rig):
    def lose(cycle, readings):
        if not 300 <= cycle < 307:
            return readings
        angle = readings.angle_motor.copy()
        angle[2] = np.nan
        return changed(readings, angle_motor=angle, missing=(2,))

    rig.drives.accident = lose
    assert rig.run() == 500
    assert rig.log.rows == rig.drives.cycle - 7


def test_a_silent_drive_ends_it(wam, rig):
    def lose(readings):
        angle = readings.angle_motor.copy()
        angle[2] = np.nan
        return changed(readings, angle_motor=angle, missing=(2,))

    rig.drives.accident = at(300, lose)
    stop = rig.stopped()
    assert stop.cause == "no position from drive 3 in 8 cycles (limit 8)"
    assert stop.outcome == "the drives were disabled"


def test_a_log_that_fails_brakes_the_arm(rig):
    rig.log.failing_after = 300
    stop = rig.stopped()
    assert (stop.exit_code, stop.cause) == (5, "the log is full")
    assert "braked" in stop.outcome


def test_a_fault_while_braking_disables(rig):
    def accidents(cycle, readings):
        readings = (
            changed(readings, stop="the stop switch was pressed") if cycle >= 300 else readings
        )
        return changed(readings, fault="drive 1 is on fire") if cycle >= 310 else readings

    rig.drives.accident = accidents
    stop = rig.stopped()
    assert stop.outcome == (
        "braking was cut short with 0.23 rad/s and 0.030 J left (drive 1 is on fire) and the "
        "drives were disabled"
    )
    assert rig.drives.cycle == 311


def test_drives_that_do_not_confirm(rig):
    rig.drives.accident = at(
        300, lambda r: changed(r, fault="drive 1 reported EMCY 0x1000", disabled=False)
    )
    stop = rig.stopped()
    assert stop.outcome == "the drives were told to disable, and not all confirmed it"


def test_a_bus_that_is_gone(rig):
    def gone(readings):
        raise BusStopError("bus can0 failed (Network is down)")

    rig.drives.accident = at(300, gone)
    stop = rig.stopped()
    assert stop.outcome == "the drives were told to cut off, then bus can0 failed (Network is down)"


def test_a_start_beyond_the_limits_is_refused(wam):
    rig = Rig(wam)
    lost = REST.copy()
    lost[6] = 3.1
    with pytest.raises(RefusalError) as refused:
        experiment.plan(wam, lost, rig.motion.excitation)
    assert str(refused.value) == (
        "The move from the resting pose to the start of the excitation is refused, and no drive "
        "was enabled: position of joint 7 (palm yaw) is 3.1 rad at 0.000 s, above its "
        "limit of 3 rad."
    )
