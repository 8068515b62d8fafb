"""How far an encoder may have drifted."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.checks.recorder_faults import positions


@pytest.mark.parametrize(("drift", "told"), [(-0.5, True), (-1.5, False)])
def test_an_encoder_drifts_by_no_more_than_it_told(drift, told, monkeypatch):
    """A larger drift would need a joint that moves against it all the time."""
    t = np.linspace(0.0, 10.0, 200)
    q = np.column_stack([np.sin(t), 0.42 * np.sin(1.3 * t)])
    probe = SimpleNamespace(motion=SimpleNamespace(q=q), moving=np.ones(2, dtype=bool))
    case: Any = SimpleNamespace(probe=probe, robot=SimpleNamespace(joint_names=("a", "b"), dof=2))
    fault = positions._Fault("drift", (1,), drift)
    monkeypatch.setattr(positions._Fault, "without", lambda *_: None)
    monkeypatch.setattr(positions, "_weights", lambda _: np.ones(2))
    monkeypatch.setattr(positions, "_faults", lambda *_: [(fault, 0.0)])
    monkeypatch.setattr(positions, "_left", lambda c, _: np.ones(2) * (1.0 if c else 0.1))
    monkeypatch.setattr(positions, "_left_by_springs", lambda *_: 1.0)
    found = positions.position_remarks(case, positions.CheckSettings())
    assert bool(found) is told
