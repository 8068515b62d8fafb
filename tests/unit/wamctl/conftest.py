"""The shipped arm, loaded once."""

from pathlib import Path

import pytest

from wamctl.experiment.loop import Arm
from wamctl.experiment.preflight import load_arm


@pytest.fixture(scope="session")
def wam() -> Arm:
    return load_arm("wam7.yaml")[1]


@pytest.fixture(scope="session")
def wam_path() -> Path:
    return load_arm("wam7.yaml")[0]
