"""An arm with position servos: what identification by simulation gives, and its file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import Field

from ident.dynamics.compiled_chain import chain_of
from ident.model.model_file import SERVOS
from ident.output_error.parameters import LATER, QUANTITIES, ROW
from ident.output_error.setup import MotionSegment, Setup
from ident.signals.arrays import Array
from wamctl.arm.config import Section, Vector, read_yaml, validate
from wamctl.arm.errors import DataError
from wamctl.arm.robot import Robot, cad_parameters, load_robot

FORMAT = SERVOS
VERSION = 1
STEP_S = 0.0005
"""Of fits of all recordings, and of replays; twice as much shifts the rotor by a percent."""


@dataclass(frozen=True)
class ServoModel:
    """Links of a URDF, and the servos that move them.

    Attributes:
        arm: the arm's name.
        robot: kinematics and links.
        settings: rows as `QUANTITIES` has them, shape (quantities, n).
        sd: standard errors in the same units, shape (quantities, n); NaN where not fitted.
        at_link: whether each joint's encoder sits behind the gears, shape (n,).
        resolution: smallest step of the positions [rad], shape (n,).
        noise: rms of measured against simulated positions in the fit [rad], shape (n,).
        logs: names of the recordings of the fit.
    """

    arm: str
    robot: Robot
    settings: Array
    sd: Array
    at_link: NDArray[np.bool_]
    resolution: Array
    noise: Array
    logs: tuple[str, ...]

    def value(self, name: str) -> Array:
        """A quantity by joint, in its SI unit, shape (n,).

        Raises:
            DataError: no such quantity.
        """
        if name not in ROW:
            raise DataError(f"There is no quantity {name!r}; there are {', '.join(ROW)}.")
        return self.settings[ROW[name]].copy()

    def setup(self, segments: tuple[MotionSegment, ...], step: float = STEP_S) -> Setup:
        """The arm along recordings."""
        links = chain_of(self.robot), cad_parameters(self.robot)
        return Setup(*links, self.at_link, segments, step, self.resolution)

    def replay(self, segment: MotionSegment) -> Array:
        """Positions that the simulated encoders tell along a recording [rad], shape (S, n)."""
        (made,) = self.setup((segment,)).replay(self.settings)
        return made

    def save(self, path: Path) -> None:
        """Write the model as readable YAML: quantities first, URDF last."""
        rows = {
            q.name: {
                "unit": q.unit,
                "values": [float(x) for x in self.settings[i]],
                "sd": [None if np.isnan(x) else float(x) for x in self.sd[i]],
            }
            for i, q in enumerate(QUANTITIES)
        }
        content = {
            "format": FORMAT,
            "version": VERSION,
            "arm": self.arm,
            "joints": list(self.robot.joint_names),
            "gravity_m_s2": [float(g) for g in self.robot.model.gravity.linear],
            "encoder_at_link": [bool(x) for x in self.at_link],
            "resolution_rad": [float(x) for x in self.resolution],
            "quantities": rows,
            "rms_rad": [float(x) for x in self.noise],
            "logs": list(self.logs),
            "urdf": self.robot.urdf,
        }
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)
        path.write_text(text, encoding="utf-8")


class _File(Section):
    format: str
    version: int
    arm: str
    joints: tuple[str, ...]
    gravity_m_s2: tuple[float, float, float]
    encoder_at_link: tuple[bool, ...]
    resolution_rad: Vector
    quantities: dict[str, dict[str, Any]]
    rms_rad: Vector
    logs: tuple[str, ...] = Field(default=())
    urdf: str


def is_servo_model(path: Path) -> bool:
    """Whether a `model.yaml` is of this kind."""
    content = read_yaml(path) if path.is_file() else None
    return isinstance(content, dict) and content.get("format") == FORMAT


def load_servos(path: Path | str) -> ServoModel:
    """The model of a `model.yaml` of `ident run --method simulation`.

    Raises:
        ConfigurationError: no such file, or faults in its content.
        DataError: of a later version, or without one of the quantities.
    """
    return read_servo_model(Path(path))


def read_servo_model(path: Path) -> ServoModel:
    """The model of a file.

    Raises:
        ConfigurationError: no such file, or faults in its content.
        DataError: of a later version, or without one of the quantities.
    """
    file = validate(_File, read_yaml(path), path)
    if file.version > VERSION:
        raise DataError(
            f"{path} has version {file.version}, and this program reads up to {VERSION}: update it."
        )
    n = len(file.joints)
    later = {name: {"values": [x] * n, "sd": [None] * n} for name, x in LATER.items()}
    quantities = later | file.quantities
    missing = [name for name in ROW if name not in quantities]
    if missing:
        raise DataError(f"{path} lacks the quantities {', '.join(missing)}.")
    rows = [quantities[name] for name in ROW]
    robot = load_robot(file.urdf, file.joints, (), file.gravity_m_s2, f"{path}:urdf")
    return ServoModel(
        arm=file.arm,
        robot=robot,
        settings=np.array([row["values"] for row in rows], dtype=float),
        sd=np.array([[np.nan if x is None else x for x in row["sd"]] for row in rows]),
        at_link=np.array(file.encoder_at_link),
        resolution=np.array(file.resolution_rad),
        noise=np.array(file.rms_rad),
        logs=file.logs,
    )
