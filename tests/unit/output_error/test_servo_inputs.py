"""Recordings that a stranger brings: refused in one sentence, or doubted, never a traceback."""

import warnings
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from servo_arm import ARMATURE, STEP_RAD, URDF, recording

import ident
from ident.api.servos import IdentifiedServos
from ident.export.servos import servo_mjcf
from ident.output_error.first_guess import neutral
from ident.output_error.glitches import unreachable
from ident.output_error.missing.visibility import held_by_weight
from ident.output_error.parameters import ROW
from ident.output_error.prepared import prepared
from ident.output_error.recordings import pieces, segments_of, thinned
from ident.output_error.servo_model import ServoModel
from ident.report.servos.run_page import ServoTrace
from ident.workflows.output_error.following import far_worse, fit_remarks, hardly_better
from wamctl.arm.errors import DataError

MADE = recording(8.0)
COMMAND = MADE.command.q if MADE.command is not None and MADE.command.q is not None else MADE.q


def identified(t: np.ndarray, q: np.ndarray, command: np.ndarray) -> IdentifiedServos:
    made = ident.Recording(t=t, q=q, joints=MADE.joint_names, q_command=command, name="strange")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return ident.identify(ident.Arm.from_urdf(URDF), made, method="simulation")


@pytest.mark.parametrize(
    ("every", "scale", "count"),
    [(10, 1.0, 400), (1, 1e3, 400), (1, 1.0, 30)],
    ids=["5 Hz", "milliseconds", "0.6 s"],
)
def test_too_little_is_refused_in_one_sentence(every: int, scale: float, count: int) -> None:
    kept = slice(0, count, every)
    t = scale * np.arange(len(MADE.q)) / 50
    with pytest.raises(DataError, match=r"strange: unbroken motion of .* does not give 3 pieces"):
        identified(t[kept], MADE.q[kept], COMMAND[kept])


def test_positions_in_degrees_are_refused() -> None:
    t = np.arange(len(MADE.q)) / 50
    with pytest.raises(DataError, match=r"strange: shoulder moves through \d+\.?\d*, and its URDF"):
        identified(t, np.degrees(MADE.q), np.degrees(COMMAND))


def test_commands_in_degrees_are_refused_and_in_an_unlikely_unit_doubted() -> None:
    t, q, command = np.arange(160) / 50, MADE.q[:160], COMMAND[:160]
    with pytest.raises(DataError, match=r"strange: the command of shoulder goes through \d+"):
        identified(t, q, np.degrees(command))
    found = identified(t, q, 3.0 * command)
    assert found.content["verdict"] != "trustworthy"
    assert "large_error" in [r["code"] for r in found.content["remarks"]]


def test_a_joint_that_no_command_moves_gets_no_delay() -> None:
    t, q, command = np.arange(160) / 50, MADE.q[:160], COMMAND[:160].copy()
    command[:, 1] = q[:, 1].mean()
    found = identified(t, q, command).content
    assert [p["joint"] for p in found["parameters"] if p["name"] == "delay"] == [1]
    told = [r for r in found["remarks"] if r["code"] == "poor_motion"]
    assert [r["joints"] for r in told if "never changes" in r["sentence"]] == [[2]]


def test_columns_that_are_exchanged_are_told_and_right_ones_are_not() -> None:
    t = np.arange(len(MADE.q)) / 50
    right, wrong = (identified(t, MADE.q[:, k], COMMAND[:, k]).content for k in ([0, 1], [1, 0]))
    assert "joint_order" not in [r["code"] for r in right["remarks"]]
    (told,) = (r for r in wrong["remarks"] if r["code"] == "joint_order")
    assert told["joints"] == [1, 2]


def test_a_simulation_that_runs_away_has_an_error_and_no_warning() -> None:
    arm = ident.Arm.from_urdf(URDF).of_recording(MADE.joint_names)
    begun = prepared(arm, segments_of(MADE, MADE.joint_names, "strange"))
    wild = begun.start.copy()
    wild[ROW["integral"]] = 1e5
    with np.errstate(all="raise"):
        left = begun.setup.residuals(wild)
        assert np.isfinite(np.sum(left**2))
    assert np.abs(left).max() > 1e3


def test_weight_holds_the_gears_of_an_arm_that_is_stretched_out_and_not_of_one_that_hangs() -> None:
    arm = ident.Arm.from_urdf(URDF).of_recording(MADE.joint_names)
    setup = prepared(arm, segments_of(MADE, MADE.joint_names, "strange")).setup
    calm = tuple(
        replace(s, q=0.2 * s.q, motion=s.motion._replace(start=0.2 * s.motion.start))
        for s in setup.segments
    )
    stretched = neutral(2)
    hanging = stretched.copy()
    hanging[ROW["zero"], 0] = np.pi / 2
    assert held_by_weight(replace(setup, segments=calm), stretched).all()
    assert not held_by_weight(replace(setup, segments=calm), hanging).any()


def test_a_wrong_byte_is_left_out_and_told_and_does_not_move_the_result() -> None:
    spoilt = MADE.q[:200].copy()
    spoilt[[90, 91, 150], [0, 0, 1]] += 3.0
    found = identified(np.arange(200) / 50, spoilt, COMMAND[:200]).content
    (remark,) = (r for r in found["remarks"] if r["code"] == "glitches")
    assert remark["sentence"] == (
        "strange: 3 positions that no motion reaches from their neighbours, at joints 1 (shoulder)"
        " and 2 (elbow), were left out; others may be wrong without showing. Check the cables, the"
        " bus and the recorder."
    )
    assert max(found["held_out"]["rms_q_by_joint"]) < 4 * STEP_RAD


def test_no_sample_of_a_motion_is_taken_for_wrong_whatever_its_rate_or_holes() -> None:
    t = np.arange(len(MADE.q)) / 50
    for every in (1, 3, 10):
        assert not unreachable(t[::every], MADE.q[::every]).any()
    rest = np.r_[0:100, 120:300]
    assert not unreachable(t[rest], MADE.q[rest]).any()


def test_an_encoder_that_wraps_is_followed_through_its_turn() -> None:
    wraps = MADE.q.copy()
    wraps[200:, 1] -= 2 * np.pi
    (segment,) = segments_of(replace(MADE, q=wraps), MADE.joint_names, "strange")
    assert segment.q == pytest.approx(MADE.q)
    assert not any(segment.wrong)


def test_a_joint_that_stalls_is_told_and_the_result_doubted() -> None:
    stalls = MADE.q[:200].copy()
    stalls[60:140, 0] = stalls[60, 0]
    found = identified(np.arange(200) / 50, stalls, COMMAND[:200]).content
    assert found["verdict"] == "doubtful"
    (remark,) = (r for r in found["remarks"] if r["code"] == "stalled")
    assert remark["joints"] == [1]
    assert "stands still for 0.5 s while the simulated one moves" in remark["sentence"]


@pytest.mark.parametrize(
    ("offset", "wrong"), [((0.0, 0.0), []), ((0.3, 0.0), [0])], ids=["as commanded", "another zero"]
)
def test_a_simulation_is_judged_beside_what_the_commands_say(offset, wrong) -> None:
    """A model replayed along commands that are not those of the recording is doubted."""
    t = np.arange(300) / 50
    measured = np.column_stack([np.sin(t), np.cos(2 * t)])
    simulated = measured + 0.003 + np.array(offset)
    trace = ServoTrace("strange", t, measured + 0.02, measured, simulated)
    rms = np.sqrt(np.mean((simulated - measured) ** 2, axis=0))
    places = hardly_better(rms, [trace], np.full(2, 1.5e-3), np.ones(2, dtype=bool))
    assert places.tolist() == wrong


@pytest.mark.parametrize(
    ("fitted", "left_out", "codes"),
    [(0.01, 0.02, []), (0.01, 0.4, ["poor_motion"]), (0.4, 0.5, ["large_error"])],
)
def test_a_limit_that_one_stretch_shows_is_no_end_stop(fitted, left_out, codes) -> None:
    """What the model follows, but for stretches that are left out, has nothing in its way."""
    t = np.arange(600) / 50
    commanded = np.sin(t)[:, None]
    trace = ServoTrace("log", t, commanded, 0.5 * commanded, 0.5 * commanded)
    args = [trace], np.full(1, 1.5e-3), np.ones(1, dtype=bool), ("elbow",)
    said = fit_remarks(np.array([fitted]), np.array([left_out]), *args)
    assert [r.code for r in said] == codes
    assert not any("end stop" in r.sentence for r in said if r.code == "poor_motion")


def test_several_short_motions_are_enough() -> None:
    """Each is predicted from the others; one of them alone is cut into three."""
    (whole,) = segments_of(MADE, MADE.joint_names, "strange")
    short = pieces([whole], 4)
    assert len(thinned(short[:3])) == 3
    with pytest.raises(DataError, match="does not give 3 pieces"):
        thinned(short[:1])


def told_of(t: np.ndarray, q: np.ndarray, command: np.ndarray) -> list[str]:
    """Codes of what is said of a recording."""
    return [r["code"] for r in identified(t, q, command).content["remarks"]]


def test_commands_far_ahead_are_a_delay_and_no_heavy_rotor() -> None:
    """Stamped 0.2 s early: the arm answers in 15 ms, and has the rotor that it has."""
    made = recording(16.0)
    assert made.command is not None
    assert made.command.q is not None
    t, shift = np.arange(len(made.q)) / 50, 10
    found = identified(t[:-shift], made.q[:-shift], made.command.q[shift:])
    assert found.model.value("delay") == pytest.approx(0.215, abs=0.015)
    assert (found.model.value("armature") < 2.5 * ARMATURE).all()


def test_commands_behind_the_motion_are_told() -> None:
    t, shift = np.arange(len(MADE.q)) / 50, 5
    found = identified(t[shift:], MADE.q[shift:], COMMAND[:-shift])
    assert "answers its commands before" in " ".join(r["sentence"] for r in found.remarks)


def test_commands_that_are_the_positions_are_told() -> None:
    t = np.arange(len(MADE.q)) / 50
    assert "commands" in told_of(t, MADE.q, MADE.q)


def test_a_zero_between_commands_and_positions_is_told() -> None:
    t = np.arange(len(MADE.q)) / 50
    found = identified(t, MADE.q + np.array([0.0, 0.5]), COMMAND)
    (told,) = (r for r in found.content["remarks"] if r["code"] == "commands")
    assert told["joints"] == [2]


def test_zeros_far_off_are_told() -> None:
    t = np.arange(len(MADE.q)) / 50
    assert "zero_pose" in told_of(t, MADE.q + np.array([0.0, 1.5]), COMMAND + np.array([0.0, 1.5]))


def test_a_joint_that_is_held_does_not_stall() -> None:
    t, held = np.arange(len(MADE.q)) / 50, MADE.q.copy()
    held[:, 1], command = 0.3, COMMAND.copy()
    command[:, 1] = 0.32
    assert "stalled" not in told_of(t, held, command)


def test_a_replay_far_worse_than_the_fit_is_told(arm_model: ServoModel) -> None:
    """Of other gains or loads, perhaps; a little worse is what new motions are."""
    judged, noise = np.arange(2), np.maximum(arm_model.noise, arm_model.resolution)
    assert not far_worse("log", 3.0 * noise, arm_model, judged)
    (told,) = far_worse("log", [1.0, 8.0] * noise, arm_model, judged)
    assert told.joints == (2,)


def test_a_constant_torque_is_part_of_the_exported_actuator(arm_model: ServoModel) -> None:
    """It lets the joint give by torque over stiffness, and no spring has to hold it."""
    settings = arm_model.settings.copy()
    settings[ROW["offset"]], settings[ROW["spring"]] = [0.0, 0.3], 0.0
    root = ElementTree.fromstring(servo_mjcf(replace(arm_model, settings=settings)))
    first, second = list(root.find("actuator") or [])
    assert (first.tag, second.tag) == ("position", "general")
    stiffness = settings[ROW["stiffness"], 1]
    bias = [float(x) for x in second.attrib["biasprm"].split()]
    assert bias == pytest.approx([-0.3, -stiffness, 0.0])


def test_a_model_of_servos_is_scored_by_its_positions(arm_model: ServoModel) -> None:
    t = np.arange(len(MADE.q)) / 50
    again = ident.Recording(t=t, q=MADE.q, joints=MADE.joint_names, q_command=COMMAND)
    assert ident.score(arm_model, again) == pytest.approx([0.0, 0.0], abs=2 * STEP_RAD)


def test_torque_that_is_missing_leads_to_the_method_without() -> None:
    t = np.arange(len(MADE.q)) / 50
    made = ident.Recording(t=t, q=MADE.q, joints=MADE.joint_names, q_command=COMMAND)
    with pytest.raises(DataError, match="method='simulation'"):
        ident.identify(ident.Arm.from_urdf(URDF), made)


@pytest.fixture(scope="module")
def arm_model() -> ServoModel:
    return identified(np.arange(len(MADE.q)) / 50, MADE.q, COMMAND).model
