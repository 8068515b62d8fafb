"""The servo arm's recordings and one identification of it, made once."""

from pathlib import Path

import pytest
from servo_arm import log
from typer.testing import CliRunner

from ident.cli import app


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("servo_logs")
    return log(folder / "fitted.mcap", seed=0), log(folder / "other.mcap", seed=1)


@pytest.fixture(scope="session")
def identified(logs: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("servo_model")
    done = CliRunner().invoke(app, ["run", str(logs[0]), "--out", str(out)])
    assert done.exit_code == 0, done.output
    (out / "said.txt").write_text(done.stdout, encoding="utf-8")
    return out
