"""Joints under other names: matched where one numbering or prefix leaves no doubt."""

import pytest

from ident.recordings.joint_names import renamed

PANDA = (*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1", "panda_finger_joint2")
UR = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")


def test_one_numbering():
    recorded = [f"fer_joint{k}" for k in range(1, 8)]
    pairs = renamed(recorded, PANDA, ())
    assert pairs == tuple((f"fer_joint{k}", f"panda_joint{k}") for k in range(1, 8))


def test_one_prefix_either_way():
    behind = tuple(f"left/{name}" for name in UR)
    assert renamed(behind, UR, ()) == tuple(zip(behind, UR, strict=True))
    assert renamed(UR, behind, ()) == tuple(zip(UR, behind, strict=True))


@pytest.mark.parametrize(
    "recorded",
    [
        ["fer_joint1", "fer_joint2", "fer_joint3"],
        [f"joint{k}" for k in range(8)],
        ["base", "shoulder", "elbow"],
        [*(f"a{k}" for k in range(1, 8)), *(f"b{k}" for k in range(1, 8))],
    ],
)
def test_where_there_is_doubt_nothing_is_matched(recorded):
    assert renamed(recorded, PANDA, ()) == ()


def test_names_that_the_arm_has_are_left_alone():
    assert renamed(["elbow_joint", "wrist"], UR, ()) == ()


def test_as_told():
    pairs = renamed(["fer_joint1", "grip"], PANDA, [("fer_", "panda_")])
    assert pairs == (("fer_joint1", "panda_joint1"),)
