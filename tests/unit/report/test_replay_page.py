"""The page of `ident export --replay`."""

from pathlib import Path

import numpy as np
import pytest

from ident.export.replay import Replay, rms_of
from ident.report.page import render
from ident.report.replay_page import ReplayReport, replay_page

STEP = 4  # decimal places of a recorded position [rad]


def page(mujoco: float, left_out: tuple[str, ...] = (), size: float = 1e-3):
    """Of two joints of which the second is `mujoco` times as far off as in our own simulation."""
    t = np.arange(500) * 0.01
    measured = np.round(np.column_stack([np.sin(t), np.cos(t)]), STEP)
    errors = np.array([size, size * mujoco])
    replay = Replay("log.mcap", ("a", "b"), t, measured, measured + errors, measured + size)
    assert rms_of([replay])["mujoco"] == pytest.approx(errors.tolist())
    return replay_page(ReplayReport("arm", Path("arm.xml"), Path("m.yaml"), left_out, [replay]))


def test_alike():
    found = page(1.1)
    assert found.verdict.status == "good"
    assert "MuJoCo is at most 1.1 mrad (rms, 2 b)" in found.verdict.sentence
    html = render(found)
    assert html.count("MuJoCo") > 3
    assert "What the file has no place for" not in html


def test_errors_below_the_encoders_steps_are_alike():
    assert page(4.0, size=1e-5).verdict.status == "good"
    assert page(8.0, size=1e-5).verdict.status == "warning"


def test_not_alike():
    found = page(3.0, ("left out, since MJCF has no place for it: effect backlash of b",))
    assert found.verdict.status == "warning"
    assert "more than 1.2 times our own at 2 b: the file has no place" in found.verdict.more[0]
    assert "effect backlash of b" in render(found)
