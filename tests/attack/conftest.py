"""The shipped arm, loaded once."""

import pytest

from wamctl.experiment.loop import Arm
from wamctl.experiment.preflight import load_arm


@pytest.fixture(scope="session")
def wam() -> Arm:
    return load_arm("wam7.yaml")[1]
