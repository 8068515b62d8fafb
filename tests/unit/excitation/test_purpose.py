"""Motions for a gap: what they show, and purposes that cannot be read."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.excitation.design import Design, DesignTask
from ident.excitation.effect_motions import MOTIONS, Frame, Sketch, stretched_sweep
from ident.excitation.target_effect import Purpose, design_motion, purpose_of
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.trajectory import read_trajectory
from wamctl.arm.trajectory_check import check_trajectory


def position_and_velocity(found: Design) -> tuple[np.ndarray, np.ndarray]:
    values = {q.name: q.values for q in found.quantities}
    return values["position"], values["velocity"]


@pytest.mark.parametrize("motion", MOTIONS.values())
def test_each_motion_of_the_library_moves_the_arm_within_its_limits(
    place: DesignTask, motion: Callable[[Frame], Sketch]
) -> None:
    effect = next(e.id for e in catalogue().values() if MOTIONS.get(e.motion) is motion)
    found = design_motion(place, Purpose(effect, 2))
    _, qd = position_and_velocity(found)
    moved = 0 if motion is stretched_sweep else 1  # the tilt's motion is always joint 1's
    assert np.abs(qd[:, moved]).max() > 0.05
    assert found.trajectory.periods >= 3
    assert found.passed == []
    assert check_trajectory(place.arm, place.robot, found.trajectory) == []


@pytest.mark.parametrize("effect", ["thermal_drift", "contact", "dropped_samples"])
def test_what_time_shows_repeats_the_arms_own_motion(place: DesignTask, effect: str) -> None:
    found = design_motion(place, purpose_of(effect)).trajectory
    own = read_trajectory("wam7-excitation.yaml").series
    assert found.periods * found.series.period_s == pytest.approx(300.0)
    assert found.series.a / own.a == pytest.approx(np.ones(own.a.shape), rel=0.1)


def test_nothing_to_repeat(place: DesignTask) -> None:
    excitation = place.arm.excitation.model_copy(update={"trajectory": None})
    arm = place.arm.model_copy(update={"excitation": excitation})
    with pytest.raises(ConfigurationError) as caught:
        design_motion(replace(place, arm=arm), purpose_of("contact"))
    assert str(caught.value).endswith(
        ": excitation.trajectory: name the motion to repeat; design one first, without --for."
    )


def test_stribeck_turns_one_joint_back_slowly(place: DesignTask) -> None:
    found = design_motion(place, purpose_of("stribeck:4"))
    assert found.trajectory.promise["shows"] == "stribeck:4"
    _, qd = position_and_velocity(found)
    assert np.count_nonzero(np.diff(np.sign(qd[:, 3]))) >= 15
    assert np.mean(np.abs(qd[:, 3]) < 0.1) > 0.3
    assert np.abs(np.delete(qd, 3, axis=1)).max() == 0.0


def test_tilt_sweeps_the_first_joint(place: DesignTask) -> None:
    q, _ = position_and_velocity(design_motion(place, purpose_of("gravity_tilt")))
    assert np.ptp(q[:, 0]) > np.pi
    assert np.ptp(q[:, 1:], axis=0).max() == 0.0


def test_a_differential_changes_its_dominant_joint(place: DesignTask) -> None:
    _, qd = position_and_velocity(design_motion(place, purpose_of("coupled_friction:5")))
    faster = np.abs(qd[:, 4]) > np.abs(qd[:, 5])
    assert 0.25 < faster.mean() < 0.75
    assert np.abs(qd[:, :4]).max() == 0.0


def test_a_gap_file_is_a_purpose(tmp_path: Path) -> None:
    path = tmp_path / "gap.json"
    effects = [
        {"name": "stribeck", "joints": [2], "separating_experiment": None},
        {"name": "backlash", "joints": [4], "separating_experiment": "turn back slowly"},
    ]
    path.write_text(json.dumps({"effects": effects}))
    assert purpose_of(str(path)) == Purpose("backlash", 4)


def test_a_gap_file_that_asks_for_a_contact(tmp_path: Path) -> None:
    path = tmp_path / "gap.json"
    effect = {"name": "contact", "joints": [], "separating_experiment": "contact"}
    path.write_text(json.dumps({"effects": [effect]}))
    assert purpose_of(str(path)) == Purpose("contact", None)


def test_a_file_that_is_no_gap(tmp_path: Path) -> None:
    path = tmp_path / "gap.json"
    path.write_text("{}")
    with pytest.raises(DataError) as caught:
        purpose_of(str(path))
    why = "is not a gap.json that can be read (it has no 'effects'): give what `ident gap` wrote."
    assert str(caught.value) == f"{path} {why}"


def test_a_gap_file_without_a_question(tmp_path: Path) -> None:
    path = tmp_path / "gap.json"
    path.write_text(json.dumps({"effects": []}))
    with pytest.raises(DataError) as caught:
        purpose_of(str(path))
    assert str(caught.value) == (
        f"{path} asks for no separating experiment: nothing in it is ambiguous."
    )


def test_a_joint_that_is_no_number() -> None:
    with pytest.raises(ConfigurationError) as caught:
        purpose_of("stribeck:elbow")
    assert str(caught.value) == "--for: 'elbow' is not the number of a joint."


def test_a_joint_that_the_arm_lacks(place: DesignTask) -> None:
    with pytest.raises(ConfigurationError) as caught:
        design_motion(place, Purpose("stribeck", 9))
    assert str(caught.value) == "--for: no joint 9; the arm has 1 to 7."
