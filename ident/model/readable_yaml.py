"""YAML that people read: long texts as blocks, short lists of numbers in one line."""

from pathlib import Path
from typing import Any

import yaml

from wamctl.arm.errors import write_text


def write_yaml(path: Path, content: dict[str, Any]) -> None:
    """Write a mapping in the order given.

    Raises:
        DataError: the file cannot be written.
    """
    text = yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    write_text(path, text)


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
