"""The simulated arm as a child process: nothing of it stays."""

import os
import tempfile

import pytest

from wamctl.arm.config import find_file
from wamctl.experiment.simulator import simulated_arm


def test_an_interrupt_as_its_folder_is_made_leaves_none_behind(tmp_path, monkeypatch):
    make = os.mkdir

    def interrupted(path, mode=0o777):
        make(path, mode)
        raise KeyboardInterrupt

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(os, "mkdir", interrupted)
    with (
        pytest.raises(KeyboardInterrupt),
        simulated_arm(find_file("wam7.yaml"), seed=0, lockstep=True),
    ):
        pass
    assert list(tmp_path.iterdir()) == []
