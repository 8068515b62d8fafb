"""The published definitions of the ROS 2 messages in a log, as the schemas that a bag carries."""

import re
from pathlib import Path

_FOLDER = Path(__file__).parent / "messages"
_RULE = "=" * 80
_FIELD = re.compile(r"^\s*([A-Za-z]\w*(?:/\w+)?)(?:\[[^\]]*\])?\s+\w+", re.MULTILINE)


def definition(type_name: str) -> str:
    """A message's definition with that of every message in it, in MCAP's `ros2msg` encoding.

    Args:
        type_name: for instance `sensor_msgs/msg/JointState`.
    """
    texts = [_text(type_name)]
    texts += [
        f"{_RULE}\nMSG: {name.replace('/msg/', '/')}\n{_text(name)}" for name in _parts(type_name)
    ]
    return "\n".join(texts)


def _text(type_name: str) -> str:
    return (_FOLDER / f"{type_name}.msg").read_text(encoding="utf-8")


def _parts(type_name: str) -> list[str]:
    """The messages inside a message, each once, before its own parts."""
    package = type_name.split("/")[0]
    found: dict[str, None] = {}
    for field in _FIELD.findall(_text(type_name)):
        name = field.replace("/", "/msg/") if "/" in field else f"{package}/msg/{field}"
        if (_FOLDER / f"{name}.msg").exists():
            found |= dict.fromkeys([name, *_parts(name)])
    return list(found)
