"""YAML files: where they are, what they hold, and every fault of it in one sentence."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wamctl.arm.errors import ConfigurationError, did_you_mean, reason_of

M = TypeVar("M", bound=BaseModel)


_PACKAGE = Path(__file__).parents[2]
_LONGEST_VALUE = 80
"""Characters of a wrong value that a message repeats: to YAML, a text of any kind is one word."""


def shipped_file(name: str) -> Path:
    """Path of a file in `configs/`, from the source tree or from the installed wheel."""
    inside_wheel = _PACKAGE / "configs" / name
    return inside_wheel if inside_wheel.exists() else _PACKAGE.parent / "configs" / name


def find_file(path: str | Path) -> Path:
    """The file itself, or the shipped file of that bare name.

    Raises:
        ConfigurationError: no such file; the sentence lists the shipped ones of its kind.
    """
    path = Path(path)
    if path.is_file():
        return path
    if path.name == str(path) and shipped_file(path.name).is_file():
        return shipped_file(path.name)
    paths = sorted(shipped_file("").glob(f"*{path.suffix or '.yaml'}"))
    shipped = [p.name for p in paths]
    alike = [p.name for p in paths if did_you_mean(path.stem, [p.stem])]
    meant = did_you_mean(path.name, alike).removeprefix("; ")
    hint = f"{meant} shipped: {', '.join(shipped)}".strip()
    raise ConfigurationError(path, [f"no such file, and none of that name is shipped ({hint})"])


def beside(config: Path, name: str) -> Path:
    """A path written in a configuration file: absolute, or relative to that file."""
    return (config.parent / name).resolve()


class _UniqueKeys(yaml.SafeLoader):
    """PyYAML's safe loader, which also refuses a key that stands twice in one mapping."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """The mapping of a node.

        Raises:
            yaml.constructor.ConstructorError: a key stands twice.
        """
        seen = set()
        for key, _ in node.value:
            if key.value in seen and key.tag != "tag:yaml.org,2002:merge":
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key.value!r} stands twice", key.start_mark
                )
            if isinstance(key.value, str):
                seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        ConfigurationError: unreadable file.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(path, [f"cannot be read ({reason_of(error)})"]) from error


def read_yaml(path: Path) -> object:
    """The content of a YAML file.

    Raises:
        ConfigurationError: unreadable file or broken YAML, with its line.
    """
    try:
        return yaml.load(read_text(path), _UniqueKeys)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise ConfigurationError(
            path, [f"not valid YAML{where} ({getattr(error, 'problem', error)})"]
        ) from error


def validate(kind: type[M], content: object, source: Path | str) -> M:
    """The model of parsed YAML.

    Raises:
        ConfigurationError: every fault at once, each with its place in the file.
    """
    if not isinstance(content, dict):
        what = "holds no keys with values, as YAML files here do"
        if isinstance(content, str) and content.lstrip().startswith("<"):
            what = "is XML, such as a URDF, and no YAML file"
        raise ConfigurationError(source, [what])
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise ConfigurationError(
            source, [f for e in error.errors() for f in _sentences(kind, e["loc"], _message(e))]
        ) from error


def _message(error: ErrorDetails) -> str:
    """What is wrong, with the value where that is a number or a short word."""
    text, given = error["msg"].partition(", unable to parse")[0], error["input"]
    if isinstance(given, str | int | float) and len(repr(given)) <= _LONGEST_VALUE:
        return text.replace("Input should be", f"{given!r} should be", 1)
    return text


def _sentences(kind: type[BaseModel], place: Sequence[int | str], message: str) -> list[str]:
    text = message.removeprefix("Value error, ")
    if not place:
        return text.split("; ")
    if place[0] == "drives" and len(place) > 1:  # pydantic puts the protocol's name in between
        place = (place[0], *place[2:])
    meant = _meant(kind, place)
    known = {
        "Extra inputs are not permitted": f"unknown key{meant}",
        "Unexpected keyword argument": f"unknown key{meant}",  # of a dataclass
        "Field required": "missing",
    }
    where = ".".join(str(p) for p in place)
    return [f"{where}: {known.get(s, s[:1].lower() + s[1:])}" for s in text.split("; ")]


def _meant(kind: type[BaseModel], place: Sequence[int | str]) -> str:
    """The key that a word stands for or is like, of those that stand where it does."""
    word, section = str(place[-1]), _section(kind, place)
    if section is None:
        return ""
    other = getattr(section, "other_words", {}).get(word)
    return f"; did you mean {other}?" if other else did_you_mean(word, section.model_fields)


def _section(kind: type[BaseModel], place: Sequence[int | str]) -> type[BaseModel] | None:
    """The section that a place is in; None in a list, or where there are several kinds."""
    for name in place[:-1]:
        field = kind.model_fields.get(str(name))
        parts = [] if field is None else [field.annotation, *get_args(field.annotation)]
        models = [p for p in parts if isinstance(p, type) and issubclass(p, BaseModel)]
        if len(models) != 1:
            return None
        kind = models[0]
    return kind
