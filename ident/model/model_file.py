"""`model.yaml`: the identified arm as readable text, links first, URDF last."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import Field

from ident.dynamics.parameters import Terms, standard_parameters
from ident.model.arm import TERM_NAMES
from ident.model.identified_model import BaseParameter, Filter, Model
from wamctl.arm.config import Section, Vector, read_yaml, validate
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import INERTIAL_NAMES
from wamctl.arm.robot import load_robot

FORMAT = "wam-ident model"
VERSION = 1


class _FilterSection(Section):
    cutoff_hz: float
    order: int
    differentiation_cutoff_hz: float
    sign_cutoff_hz: float
    parallel: bool
    velocity_threshold_rad_s: float


class _Link(Section):
    joint: str
    inertia_kg_m2: dict[str, float]
    first_moment_kg_m: dict[str, float]
    mass_kg: float
    friction: dict[str, float] = Field(default={})


class _BaseParameterEntry(Section):
    name: str
    unit: str
    values: dict[str, float]
    sd: float


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
    base_parameters: tuple[_BaseParameterEntry, ...]
    filter: _FilterSection
    logs: tuple[str, ...]
    effects: tuple[dict[str, Any], ...] = Field(default=())
    urdf: str


def load_model(path: Path | str) -> Model:
    """The model of a `model.yaml`.

    Raises:
        ConfigurationError: no such file, or not valid YAML, or faults in its content.
        DataError: not a model file, or of a later version.
    """
    content = read_yaml(Path(path))
    kind = content.get("format") if isinstance(content, dict) else None
    if kind != FORMAT:
        raise DataError(f"{path} is not a model: its format is {kind!r}, not {FORMAT!r}.")
    file = validate(_ModelFile, content, path)
    if file.version > VERSION:
        raise DataError(
            f"{path} has version {file.version}, and this program reads up to {VERSION}: update it."
        )
    return _model(file, str(path))


def _model(file: _ModelFile, source: str) -> Model:
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
        base_parameters=tuple(BaseParameter(**b.model_dump()) for b in file.base_parameters),
        filter=Filter(**file.filter.model_dump()),
        noise=np.array([np.nan if x is None else x for x in file.noise_nm]),
        logs=file.logs,
        effects=file.effects,
    )


def write_model(path: Path, model: Model) -> None:
    """The model as readable YAML: links first, the URDF last."""
    text = yaml.dump(
        _content(model), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100
    )
    path.write_text(text, encoding="utf-8")


def _content(model: Model) -> dict[str, Any]:
    robot, terms = model.robot, model.terms
    return {
        "format": FORMAT,
        "version": VERSION,
        "arm": model.arm,
        "estimator": model.estimator,
        "joints": list(robot.joint_names),
        "moving": [bool(m) for m in model.moving],
        "noise_nm": [None if np.isnan(x) else float(x) for x in model.noise],
        "gravity_m_s2": [float(g) for g in robot.model.gravity.linear],
        "parameter_frames": list(robot.parameter_frames),
        "terms": [name for name in TERM_NAMES if getattr(terms, name)],
        "drive_matrix": [[float(x) for x in row] for row in terms.drive_matrix],
        "motor_friction": terms.motor_friction,
        "links": [_link(model, k) for k in range(1, robot.dof + 1)],
        "base_parameters": [
            {"name": b.name, "unit": b.unit, "values": b.values, "sd": b.sd}
            for b in model.base_parameters
        ],
        "filter": vars(model.filter),
        "logs": list(model.logs),
        "effects": list(model.effects),
        "urdf": model.robot.urdf,
    }


def _link(model: Model, k: int) -> dict[str, Any]:
    values = {
        p.name: float(x) for p, x in zip(model.parameters, model.delta, strict=True) if p.index == k
    }
    return {
        "joint": model.robot.joint_names[k - 1],
        "inertia_kg_m2": {s: values[f"L{k}{s}"] for s in INERTIAL_NAMES[:6]},
        "first_moment_kg_m": {s: values[f"l{k}{s}"] for s in INERTIAL_NAMES[6:9]},
        "mass_kg": values[f"m{k}"],
        "friction": {
            p.kind: values[p.name]
            for p in model.parameters
            if p.index == k and p.kind != "inertial"
        },
    }


class _Dumper(yaml.SafeDumper):
    """YAML with long texts as blocks, and short lists of numbers in one line."""


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.Node:
    style = "|" if "\n" in value else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


def _list(dumper: yaml.SafeDumper, value: list) -> yaml.Node:
    plain = all(not isinstance(x, list | dict) for x in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=plain)


def _mapping(dumper: yaml.SafeDumper, value: dict) -> yaml.Node:
    numbers = bool(value) and all(isinstance(x, float) for x in value.values())
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=numbers)


_Dumper.add_representer(str, _text)
_Dumper.add_representer(list, _list)
_Dumper.add_representer(dict, _mapping)
