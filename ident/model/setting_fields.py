"""Kinds of numbers in the settings."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """Numbers of one stage, frozen."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def positive(value: float, description: str) -> Any:
    """A number above zero."""
    return Field(default=value, gt=0.0, allow_inf_nan=False, description=description)


def share(value: float, description: str) -> Any:
    """A share of a whole."""
    return Field(default=value, ge=0.0, le=1.0, description=description)


def count(value: int, description: str) -> Any:
    """A count of at least one."""
    return Field(default=value, ge=1, description=description)


def table(settings: Section) -> str:
    """All settings as a Markdown table, section by section."""
    lines = ["| setting | value | meaning [unit], and reason |", "| --- | --- | --- |"]
    for name in type(settings).model_fields:
        section = getattr(settings, name)
        for key, info in type(section).model_fields.items():
            value = f"{getattr(section, key):g}"
            lines.append(f"| `{name}.{key}` | {value} | {info.description} |")
    return "\n".join(lines)
