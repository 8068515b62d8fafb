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
