"""The identified arm as readable text: links first, URDF last."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from ident.model.arm import TERM_NAMES
from wamctl.arm.errors import writing
from wamctl.arm.inertial import INERTIAL_NAMES

if TYPE_CHECKING:
    from ident.model.identified_model import Model

FORMAT = "wam-ident model"
VERSION = 1


def write_model(path: Path, model: "Model") -> None:
    """The model as readable YAML: links first, the URDF last.

    Raises:
        DataError: the file cannot be written.
    """
    text = yaml.dump(
        _content(model), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100
    )
    with writing(path):
        path.write_text(text, encoding="utf-8")


def _content(model: "Model") -> dict[str, Any]:
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
        "filter": vars(model.filter)
        | {"reversals": [[vars(part) for part in joint] for joint in model.filter.reversals]},
        "logs": list(model.logs),
        **({"gains_nm_per_a": list(model.gains_nm_per_a)} if model.gains_nm_per_a else {}),
        "effects": [e.model_dump(mode="json") for e in model.effects.records],
        "urdf": model.robot.urdf,
    }


def _link(model: "Model", k: int) -> dict[str, Any]:
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
