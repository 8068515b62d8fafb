"""The identified arm of a `model.yaml`."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydantic import Field

from ident.dynamics.parameters import Terms, standard_parameters
from ident.model.arm import TERM_NAMES
from ident.model.fit_filter import Filter
from ident.model.identified_model import FORMAT, VERSION, Model, ModelEffects
from ident.model.records import BaseParameter, EffectRecord, errors_from
from wamctl.arm.config import Section, Vector, read_yaml, validate
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.robot import load_robot


class _Link(Section):
    joint: str
    inertia_kg_m2: dict[str, float]
    first_moment_kg_m: dict[str, float]
    mass_kg: float
    friction: dict[str, float] = Field(default={})


class _ModelFile(Section):
    format: str
    version: int
    arm: str
    estimator: str
    joints: tuple[str, ...]
    moving: tuple[bool, ...]
    noise_nm: tuple[float | None, ...]
    gravity_m_s2: tuple[float, float, float]
    parameter_frames: tuple[str, ...]
    terms: tuple[str, ...]
    drive_matrix: tuple[Vector, ...]
    motor_friction: bool
    links: tuple[_Link, ...]
    base_parameters: tuple[BaseParameter, ...]
    errors: dict[str, tuple[float, ...]] = Field(default={})
    filter: Filter
    logs: tuple[str, ...]
    gains_nm_per_a: tuple[float, ...] = Field(default=())
    effects: tuple[EffectRecord, ...] = Field(default=())
    urdf: str


Bind = Callable[[tuple[EffectRecord, ...]], ModelEffects]
"""Gives effects their equations."""


SERVOS = "wam-ident servo model"
"""Format of the models of another method."""

_WANTED = "give the model.yaml that `ident run` or `ident gap` wrote"


def read_model(path: Path | str, bind: Bind) -> Model:
    """The model of a `model.yaml`.

    Args:
        path: the file.
        bind: gives the named effects their equations.

    Raises:
        ConfigurationError: no such file, or not valid YAML, or faults in its content.
        DataError: not a model file, or of a later version.
    """
    if not Path(path).is_file():
        raise ConfigurationError(path, [f"no such file; {_WANTED}"])
    content = read_yaml(Path(path))
    kind = content.get("format") if isinstance(content, dict) else None
    if kind == SERVOS:
        raise DataError(
            f"{path} is a model of position servos, without torques: `ident validate` and `ident"
            " export` take it, and ident.load_servos(path) reads it."
        )
    if kind != FORMAT:
        raise DataError(f"{path} is not a model: {_WANTED}.")
    file = validate(_ModelFile, content, path)
    if file.version > VERSION:
        raise DataError(
            f"{path} has version {file.version}, and this program reads up to {VERSION}: update it."
        )
    return _model(file, str(path), bind)


def _model(file: _ModelFile, source: str, bind: Bind) -> Model:
    robot = load_robot(
        file.urdf, file.joints, file.parameter_frames, file.gravity_m_s2, f"{source}:urdf"
    )
    terms = Terms(
        **{name: name in file.terms for name in TERM_NAMES},
        drive_matrix=np.array(file.drive_matrix),
        motor_friction=file.motor_friction,
    )
    values: dict[str, float] = {}
    for k, link in enumerate(file.links, 1):
        values |= {f"L{k}{axis}": x for axis, x in link.inertia_kg_m2.items()}
        values |= {f"l{k}{axis}": x for axis, x in link.first_moment_kg_m.items()}
        values |= {f"m{k}": link.mass_kg} | {f"{name}{k}": x for name, x in link.friction.items()}
    names = [p.name for p in standard_parameters(robot, terms)]
    missing = [n for n in names if n not in values]
    if missing:
        raise DataError(f"{source} lacks the parameters {', '.join(missing)}.")
    return Model(
        arm=file.arm,
        estimator=file.estimator,
        robot=robot,
        terms=terms,
        delta=np.array([values[n] for n in names]),
        moving=np.array(file.moving),
        base_parameters=file.base_parameters,
        filter=file.filter,
        noise=np.array([np.nan if x is None else x for x in file.noise_nm]),
        logs=file.logs,
        gains_nm_per_a=file.gains_nm_per_a,
        effects=bind(file.effects),
        errors=errors_from(standard_parameters(robot, terms), file.errors),
    )
