"""Wire time against the table of worked cases: 1 Mbit/s, 500 Hz, eight heartbeats at 10 Hz."""

import pytest

from wamctl.arm.config import BusSection, load_arm_file
from wamctl.canopen.bus_load import plan
from wamctl.drives import bus_load

CLASSIC = BusSection(channel="sim")
FD = BusSection(channel="sim", data_bitrate_bit_s=5e6)
DRIVES = load_arm_file("wam7.yaml").drives.model_copy(update={"temperature_limit_c": None})


@pytest.mark.parametrize(
    ("length", "nominal", "worst"),
    [(0, 47, 55), (1, 55, 65), (2, 63, 75), (4, 79, 95), (6, 95, 115), (8, 111, 135)],
)
def test_bits_of_a_classic_frame(length, nominal, worst):
    assert bus_load.frame_s(CLASSIC, length) * 1e6 == pytest.approx(nominal)
    assert bus_load.stuffed_frame_s(CLASSIC, length) * 1e6 == pytest.approx(worst)


def test_group_pdos_leave_half_of_the_bus():
    load = plan(CLASSIC, DRIVES)
    assert load.nominal == pytest.approx(0.471, abs=5e-4)
    assert load.worst == pytest.approx(0.570, abs=5e-4)
    assert load.answer_us == pytest.approx(712)
    assert load.cycle_us == pytest.approx(1130)
    assert bus_load.faults(load) == []


def test_seven_torque_frames_fill_it_but_do_fit_with_short_positions():
    load = plan(CLASSIC, DRIVES.model_copy(update={"wiring": "pdo_per_drive"}))
    assert load.nominal == pytest.approx(0.637, abs=5e-4)
    assert load.worst == pytest.approx(0.768, abs=5e-4)


def test_a_kilohertz_does_not_fit_into_classic_can():
    fast = CLASSIC.model_copy(update={"period_s": 0.001})
    assert bus_load.faults(plan(fast, DRIVES)) == [
        "bus: the plan takes 114% of it with the most stuff bits (94% without any), above the "
        "limit of 80%: take shared torque frames (drives.wiring: group_pdos), a longer "
        "bus.period_s, or CAN FD (bus.data_bitrate_bit_s)"
    ]


def test_a_kilohertz_fits_into_can_fd():
    load = plan(FD.model_copy(update={"period_s": 0.001}), DRIVES)
    assert load.worst < 0.55
    assert bus_load.faults(load) == []


def test_bits_of_a_can_fd_frame():
    # 29 bits at 1 Mbit/s, 97 at 5 Mbit/s, of which 64 are data
    assert bus_load.frame_s(FD, 8) * 1e6 == pytest.approx(29 + 97 / 5)
    assert bus_load.frame_s(FD, 9) == bus_load.frame_s(FD, 12)
