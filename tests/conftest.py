"""What every test may use: the place of the real recordings, and skips that say why."""

import os
import socket
from pathlib import Path

import pytest

# Before numpy loads: the machine's cores are for the processes under test.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

PROJECT = Path(__file__).parent.parent
REAL_DATA = Path(os.environ.get("WAM_DATA", PROJECT.parent / "shared" / "data"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--can",
        metavar="INTERFACE",
        default="vcan0",
        help="the SocketCAN interface for the bus tests with the mark vcan (can0: a real one)",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    interface = config.getoption("--can")
    no_data = pytest.mark.skip(
        reason=f"no real recordings at {REAL_DATA}: set WAM_DATA to their folder"
    )
    no_can = pytest.mark.skip(
        reason=f"this kernel has no {interface}: run scripts/vcan-test, or give --can INTERFACE"
    )
    for item in items:
        if item.get_closest_marker("data") and not REAL_DATA.is_dir():
            item.add_marker(no_data)
        if item.get_closest_marker("vcan") and not has_interface(interface):
            item.add_marker(no_can)


def has_interface(name: str) -> bool:
    return name in {found for _, found in socket.if_nameindex()}


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the real recordings; for tests with the mark `data`."""
    return REAL_DATA
