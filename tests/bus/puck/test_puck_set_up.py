"""Set-up of classic Pucks on the embedded bus: what is found, what is set, what is refused."""

import numpy as np
import pytest

from sim_bus.puck.codec import Mode, SafetyState, Stat
from sim_bus.puck.drive import HAZARD_NS
from sim_bus.puck.safety_module import Press
from wamctl.errors import DrivesError
from wamctl.puck import set_up
from wamctl.puck.properties import motor_properties, safety_properties

MODULE = "safety module (node 10)"


def faults(call):
    with pytest.raises(DrivesError) as error:
        call()
    assert error.value.exit_code == 4
    return error.value.faults


def ask(arm, node, name, properties=motor_properties):
    with arm.drives() as rig:
        return rig.drives._exchange.ask(node, properties(185)[name], name)


def test_an_arm_that_is_ready_needs_no_note(classic):
    with classic.drives() as rig:
        assert rig.drives.set_up() == []
        motors = np.array(classic.file.transmission.motor_from_joint)
        q = np.linalg.solve(motors, rig.drives.resting_angles())
    assert q == pytest.approx(classic.file.simulation.start_pose_rad, abs=2e-4)


def test_groups_places_and_limits_are_set(classic):
    with classic.drives() as rig:
        rig.drives.set_up()
    groups = [tuple(ask(classic, n, g) for g in ("GRPA", "GRPB", "GRPC")) for n in range(1, 8)]
    assert groups == [(0, 1, 4)] * 4 + [(0, 2, 4)] * 3
    assert [ask(classic, n, "PIDX") for n in range(1, 8)] == [1, 2, 3, 4, 1, 2, 3]
    assert [ask(classic, n, "MT") for n in range(1, 8)] == [
        4860, 4860, 4860, 4320, 3900, 3900, 1600,
    ]  # fmt: skip
    limits = [ask(classic, 10, n, safety_properties) for n in ("TL1", "TL2", "VL1", "VL2")]
    assert limits == [4731, 5204, 2048, 4096]


def test_an_arm_that_was_left_active_is_idled(classic):
    now = classic.simulation.arm.plant.time_ns
    for frame in classic.safety.press(Press.ACTIVATE, now):
        classic.simulation.arm.receive(now, frame)
    assert all(p.mode is Mode.TORQUE for p in classic.pucks)
    with classic.drives() as rig:
        rig.drives.set_up()
    assert classic.safety.module.state is SafetyState.IDLE
    assert all(p.mode is Mode.IDLE for p in classic.pucks)


@pytest.mark.parametrize("version", [33, 50, 61, 64, 118, 200])
def test_every_firmware_can_be_driven(serve_classic, version):
    module = {"firmware": version, "torque_warning_units": 4731, "torque_fault_units": 5204}
    module |= {"speed_warning_m_s": 0.5, "speed_fault_m_s": 1.0}
    with serve_classic(firmware=[version] * 7, safety_module=module) as arm, arm.drives() as rig:
        rig.enabled()
        rig.cycle(np.full(7, 0.01))
        rig.cycle(np.full(7, 0.01))
        assert [p.torque_units for p in arm.pucks] == [27] * 4 + [65] * 2 + [175]
        rig.drives.cut_off()


def test_firmware_that_numbers_its_properties_differently_is_refused(classic):
    with classic.drives(firmware=(60, *[185] * 6)) as rig:
        assert faults(rig.drives.set_up) == [
            "the Pucks have firmware 60, 185, which number P or T differently, so that no single "
            "frame reaches all of them: update the older ones"
        ]


DIFFERENCES = [
    (
        {"torque_units_per_nm": (2700, 2562, *[2700] * 5)},
        [
            "Puck 2 (node 2) says IPNM = 2700; the configuration says 2562: every torque would be "
            "wrong by their ratio",
            "Puck 5 (node 5) says IPNM = 6500; the configuration says 2700: every torque would be "
            "wrong by their ratio",
            "Puck 6 (node 6) says IPNM = 6500; the configuration says 2700: every torque would be "
            "wrong by their ratio",
            "Puck 7 (node 7) says IPNM = 17474; the configuration says 2700: every torque would "
            "be wrong by their ratio",
        ],
    ),
    (
        {"counts_per_revolution": (40960, *[4096] * 6)},
        [
            "Puck 1 (node 1) says CTS = 4096; the configuration says 40960: every angle would be "
            "wrong by their ratio"
        ],
    ),
    (
        {"poles": (12, 12, 12, 12, 8, 8, 8)},
        [
            "Puck 7 (node 7) says POLES = 6; the configuration says 8: it drives another motor "
            "than that"
        ],
    ),
    (
        {"firmware": (*[185] * 6, 174)},
        ["Puck 7 (node 7) has firmware 185; drives.firmware in the configuration says 174"],
    ),
    (
        {"joint_encoder_counts": (1578399, *[0] * 6)},
        ["Puck 1 (node 1) has no joint encoder (ROLE 0x0100); the configuration says one"],
    ),
    (
        {"node_ids": (1, 2, 3, 4, 5, 6, 12)},
        ["Puck 7 (node 12) does not answer a question for STAT (5 times 50 ms)"],
    ),
    (
        {"node_ids": (1, 2, 3, 4, 5, 6, 10)},
        ["Puck 7 (node 10) has the role 2 (safety), not that of an arm's motor (0)"],
    ),
]


@pytest.mark.parametrize(("changes", "expected"), DIFFERENCES)
def test_a_puck_that_differs_is_refused(classic, changes, expected):
    with classic.drives(**changes) as rig:
        assert faults(rig.drives.set_up) == expected


def test_joint_encoders_are_read_past(serve_classic):
    counts = [1578399, 655360, 655360, 327680, 0, 0, 0]
    with serve_classic(joint_encoder_counts=counts) as arm, arm.drives() as rig:
        rig.drives.set_up()
        rig.drives.start()
        readings = rig.cycle()
        assert readings.missing == ()
        assert readings.angle_motor == pytest.approx(rig.drives.resting_angles())


def test_an_undeclared_joint_encoder_is_refused(serve_classic):
    with (
        serve_classic(joint_encoder_counts=[0, 655360, 0, 0, 0, 0, 0]) as arm,
        arm.drives(joint_encoder_counts=(0,) * 7) as rig,
    ):
        assert faults(rig.drives.set_up) == [
            "Puck 2 (node 2) has a joint encoder (ROLE 0x4100); the configuration says none"
        ]


def test_other_pucks_are_left_alone_and_named(classic):
    with classic.drives(node_ids=(1, 2, 3, 4, 5, 6, 9)) as rig:
        assert rig.drives._strangers({1, 7, 10, 14}) == [
            "other Pucks are on the bus and are left alone (nodes 7, 14)"
        ]
        assert 7 in rig.drives._exchange.census(0.001, 0.05)


def test_an_estop_is_named_before_anything_else(classic):
    classic.safety.press(Press.ESTOP, 0)
    with classic.drives() as rig:
        assert faults(rig.drives.set_up) == [
            f"{MODULE} is in E-STOP, so that no Puck has power: release the E-STOP button and "
            "press Shift-Idle on the pendant"
        ]


def test_an_arm_without_a_zero_is_refused(classic):
    classic.safety.module.lose_zero()
    with classic.drives() as rig:
        assert faults(rig.drives.set_up) == [
            f"{MODULE} says ZERO = 0, so that no position can be trusted since power was switched "
            "on: put the arm into its home pose and run `wamctl home`"
        ]


def power_cycle(arm):
    arm.safety.press(Press.ESTOP, 0)
    arm.safety.press(Press.IDLE, 0)
    assert all(p.stat is Stat.RESET for p in arm.pucks)


def test_pucks_in_their_monitor_are_woken_in_silence(classic):
    power_cycle(classic)
    with classic.drives() as rig:
        assert rig.drives.prepare() == [
            "Pucks in their monitor were woken (nodes 1, 2, 3, 4, 5, 6, 7)"
        ]
    assert all(p.stat is Stat.READY for p in classic.pucks)


def test_without_the_silence_the_bus_goes_off(classic, monkeypatch):
    monkeypatch.setattr(set_up, "WAKE_SILENCE_S", 0.0)
    power_cycle(classic)
    with classic.drives() as rig, classic.bus() as listener:
        with pytest.raises(DrivesError):
            rig.drives.prepare()
        frames = []
        while (frame := listener.recv(0.0)) is not None:
            frames.append(frame)
    assert any(f.is_error_frame for f in frames)
    assert HAZARD_NS < 1e9


def test_the_zero_can_be_defined_again(classic):
    power_cycle(classic)
    motors = np.array(classic.file.transmission.motor_from_joint)
    home = motors @ np.array(classic.file.drives.home_pose_rad)
    with classic.drives() as rig:
        rig.drives.prepare()
        rig.drives.define(home)
        assert rig.drives.set_up() == []
        assert rig.drives.resting_angles() == pytest.approx(home, abs=2e-3)
    assert classic.safety.module.zeroed


def test_a_fault_that_still_shows_on_the_pendant_is_a_note(classic):
    with classic.drives() as rig:
        rig.enabled()
        rig.cycle(np.full(7, 3.0))
        rig.drives.cut_off()
        assert rig.drives.set_up() == [
            "the pendant shows a fault (torque): press Shift-Idle before Shift-Activate"
        ]
