"""Where a fit begins, and what an arm's file may say of it."""

from dataclasses import replace

import numpy as np
import pytest
from servo_arm import JOINTS, recording
from servo_arm import URDF as ELBOW

import ident
from ident.model.arm import arm_from_urdf
from ident.output_error.identify import prepared
from ident.output_error.parameters import ROW
from ident.output_error.plant.servo import Motion
from ident.output_error.prepared import resolution_of, searched
from ident.output_error.recordings import segments_of
from ident.output_error.search.late_start import begun_with_delay, stamped_late
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import MotionSegment
from wamctl.arm.config import ServoSection
from wamctl.arm.errors import ConfigurationError

STIFFNESS, DAMPING, COULOMB, ROTOR, LINK = 12.0, 0.6, 0.1, 0.02, 2.5e-3
URDF = """<robot name="turntable"><link name="base"/>
  <link name="plate"><inertial><origin xyz="0.05 0 0"/><mass value="0.8"/>
    <inertia ixx="1e-4" iyy="5e-4" izz="5e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="pan" type="revolute"><parent link="base"/><child link="plate"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="20" velocity="10"/></joint></robot>"""


def turned(seconds: float = 10.0, limit: float = 10.0, steps: float = 0.0) -> ident.Recording:
    """A plate that turns on a vertical axis: gravity never pulls at it."""
    t, h = np.arange(int(seconds * 50)) / 50, 5e-4
    wanted = np.sin(2 * np.pi * np.array([0.2, 0.5, 1.1]) * t[:, None]) @ [0.5, 0.2, 0.1]
    wanted += steps * (np.floor(t) % 2)
    q, v, told = 0.0, 0.0, np.empty_like(t)
    for k in range(len(t) * 40):
        if k % 40 == 0:
            told[k // 40] = q
        pull = np.clip(STIFFNESS * (wanted[max(k - 30, 0) // 40] - q), -limit, limit)
        slip = (ROTOR + LINK) * v + h * pull
        slip -= np.clip(slip, -h * COULOMB, h * COULOMB)
        v = slip / (ROTOR + LINK + h * DAMPING)
        q += h * v
    return ident.Recording(
        t=t, q=told[:, None], joints=("pan",), q_command=wanted[:, None], name="turned"
    )


def start_of(servo: ServoSection, recording: ident.Recording | None = None) -> np.ndarray:
    arm = ident.Arm.from_urdf(URDF).of_recording(("pan",))
    log = (recording or turned()).log
    return prepared(replace(arm, servo=servo), segments_of(log, ("pan",), "turned")).start


@pytest.mark.parametrize(("limit", "steps"), [(10.0, 0.0), (2.0, 0.5)])
def test_a_joint_that_lifts_nothing_begins_with_the_usual_stiffness_and_its_own_ratios(
    limit: float, steps: float
) -> None:
    """A servo that reaches its limit at each step is no reason to begin elsewhere."""
    start = start_of(ServoSection(), turned(limit=limit, steps=steps))
    stiffness = start[ROW["stiffness"], 0]
    assert stiffness == 20.0
    for name, value in (("damping", DAMPING), ("armature", ROTOR + LINK)):
        assert start[ROW[name], 0] / stiffness == pytest.approx(value / STIFFNESS, rel=0.4), name


def test_what_a_file_says_of_the_start_is_used_and_has_to_be_possible() -> None:
    assert start_of(ServoSection(first={"stiffness": 0.01}))[ROW["stiffness"], 0] == 0.01
    with pytest.raises(
        ConfigurationError, match=r"servo: stiffness: 0\.0 is not within 0\.01 to 100000 N m/rad"
    ):
        start_of(ServoSection(first={"stiffness": 0.0}))


def test_fast_recordings_are_thinned_and_their_commands_kept() -> None:
    log = turned().log
    t = np.arange(log.stamp_ns[0], log.stamp_ns[-1], 1_000_000)
    q = np.interp(t, log.stamp_ns, log.q[:, 0])[:, None]
    (segment,) = segments_of(replace(log, stamp_ns=t, q=q), ("pan",), "turned")
    (slow,) = segments_of(log, ("pan",), "turned")
    assert np.diff(segment.motion.t) == pytest.approx(0.0095, abs=0.00051)
    assert len(slow.q) == len(log.q)
    assert segment.motion.command.shape == slow.motion.command.shape


@pytest.mark.parametrize(
    ("step", "rate"),
    [(5e-5, 500), (9.6e-5, 250), (1.5e-3, 50)],
    ids=["fine", "passed over", "hobby arm"],
)
def test_an_encoders_step_is_found_though_the_motion_passes_most_places_over(
    step: float, rate: int
) -> None:
    t = np.arange(0.0, 20.0, 1.0 / rate)
    q = np.round((np.sin(0.7 * t) * (1.0 + 0.2 * np.sin(0.31 * t)) + 0.4) / step) * step
    told = Motion(t, t, q[:, None], q[:1], np.zeros(1))
    (found,) = resolution_of([MotionSegment(told, q[:, None])])
    assert found == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize(("share", "told"), [(1.0, True), (1e-4, False)], ids=["left", "explained"])
def test_late_stamps_are_told_though_a_wrong_part_gives_a_delay(share: float, told: bool) -> None:
    """A search that cannot follow such commands may end anywhere."""
    made, shift, settings = recording(12.0), 5, SearchSettings()
    late = replace(
        made,
        q=made.q[shift:],
        stamp_ns=made.stamp_ns[:-shift],
        command=replace(made.command, q=made.command.q[:-shift], stamp_ns=made.stamp_ns[:-shift]),
    )
    begun = prepared(arm_from_urdf(ELBOW, JOINTS, "urdf"), segments_of(late, JOINTS, "log"))
    begun, base = begun_with_delay(begun, searched(begun.setup), settings)
    wrong = base.fit.settings.copy()
    wrong[ROW["delay"]] = 0.04
    found = replace(base, fit=replace(base.fit, settings=wrong), errors=share * base.errors)
    assert (stamped_late(begun, base, found, settings) >= shift / 50) is told
