"""Published robots, where `example-robot-data` is installed, and the shipped arms."""

import sys
from pathlib import Path

from wamctl.arm.config import shipped_file

_PLACE = "cmeel.prefix/share/example-robot-data/robots"


def published() -> list[Path]:
    """URDFs of example-robot-data; empty where it is not installed."""
    places = [Path(p) / _PLACE for p in sys.path]
    return sorted(file for place in places for file in place.rglob("*.urdf"))


def arms() -> list[Path]:
    """Twenty URDFs to plant faults in."""
    shipped = [shipped_file(f"{name}.urdf") for name in ("wam7", "xmate7p", "staubli_tx40")]
    clean = ("panda", "xarm7", "z1", "kinova", "ur", "so10", "solo", "g1", "human", "laikago")
    found = [p for p in published() if p.name.startswith(clean) and p.name != "ur3.urdf"]
    return (found + 20 * shipped)[:20]
