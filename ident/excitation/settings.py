"""How a design is made, as the command line may change it."""

import os
from typing import Any, Literal

from pydantic import Field

from wamctl.arm.config import NonNegative, Positive, Section, validate
from wamctl.arm.errors import ConfigurationError

Term = Literal["viscous", "coulomb", "offset", "rotor_inertia"]

Kind = Literal["condition", "determinant", "errors", "balanced"]


GOOD_CONDITION = 35.6
"""Below it, smaller errors are worth more: 36 with a hair to spare. The WAM's published motions
have 48 to 62."""


TRYING_S = 240.0
"""Time of a search that tries its motions out in closed loop, unless another one is wished."""


class DesignSettings(Section):
    """What to minimise, how, and when to stop."""

    objective: Kind | None = Field(
        default=None,
        description="the paper's condition number; the standard errors' volume, or mean; or"
        " condition number times mean. Unset: the mean, at a condition number of at most 36, or at"
        " the smallest that is found",
    )
    most_condition: Positive | None = Field(
        default=None,
        description="condition number that smaller errors may cost; unset: any, or 36 where the"
        " objective is unset, too",
    )
    terms: tuple[Term, ...] | None = Field(
        default=None, description="what the model will hold; unset: what the arm's file says"
    )
    constraints: Literal["all", "joint_motion"] | None = Field(
        default=None, description="limits to keep; unset: what the arm's file says"
    )
    weights: dict[str, Positive] = Field(
        default={}, description="of parameters or kinds, such as {ia: 2, fc4: 3}"
    )
    seed: int = Field(default=0, ge=0, description="of all random choices")
    time_s: Positive = Field(
        default=15.0, description="time to search [s]; with --model, which tries motions out, 240"
    )
    descents: int = Field(default=1_000_000, ge=1, description="of each process, at most")
    gain: NonNegative = Field(
        default=1e-3, description="an improvement of the objective by less does not count"
    )
    patience: int = Field(
        default=100, ge=1, description="descents in a row without gain that end the search"
    )
    processes: int = Field(
        default_factory=lambda: min(os.cpu_count() or 1, 8), ge=1, description="searches at once"
    )


def settled(settings: DesignSettings) -> DesignSettings:
    """The settings with an objective; unset, it is small errors at a good condition number."""
    if settings.objective is not None:
        return settings
    most = settings.most_condition or GOOD_CONDITION
    return settings.model_copy(update={"objective": "errors", "most_condition": most})


def design_settings(changes: dict[str, Any]) -> DesignSettings:
    """The settings with some of them changed.

    Raises:
        ConfigurationError: an unknown setting, or a value out of its bounds.
    """
    unknown = [name for name in changes if name not in DesignSettings.model_fields]
    if unknown:
        valid = ", ".join(DesignSettings.model_fields)
        raise ConfigurationError(
            "--set", [f"no setting {name!r}; valid are {valid}" for name in unknown]
        )
    return validate(DesignSettings, changes, "settings")
