"""The design of an excitation."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ident.api.arm import Arm
from ident.api.inputs import checked_arm
from ident.excitation.design import Design
from ident.excitation.design import design as search_design
from ident.excitation.settings import design_settings, settled
from ident.workflows.design import place_of, report_beside, save
from wamctl.arm.config import ArmFile
from wamctl.arm.errors import ConfigurationError


@dataclass(frozen=True)
class Designed:
    """A motion that makes an arm's parameters visible, within its limits.

    Attributes:
        design: the trajectory with the quantities along it.
        config: the arm's file.
        settings: how it was made.
    """

    design: Design = field(repr=False)
    config: Path
    settings: dict[str, Any]

    @property
    def promise(self) -> dict[str, Any]:
        """The condition number and the number of parameters."""
        return dict(self.design.trajectory.promise)

    @property
    def passed(self) -> tuple[str, ...]:
        """Limits that the motion does not keep, each as a sentence; empty: it may run."""
        return tuple(self.design.passed)

    def save(self, path: str | Path) -> Path:
        """Write the trajectory file, as `wamctl excite --trajectory` reads it.

        Raises:
            DataError: the file cannot be written.
        """
        save(self.design, Path(path))
        return Path(path)

    def report(self, path: str | Path) -> Path:
        """Write the report beside a trajectory file's path, as .html, and give its path."""
        return report_beside(self.design, self.config, Path(path), self.settings)


def design(arm: Arm, *, time_s: float = 15.0, **settings: Any) -> Designed:
    """Design a motion that makes an arm's parameters visible, as `ident design` does.

    Args:
        arm: an arm of a configuration file, which holds the limits.
        time_s: time to search [s].
        settings: as of `ident design --set`, such as `objective="condition"` or `seed=1`.

    Raises:
        ConfigurationError: the arm has no limits, or an unknown setting.
    """
    checked_arm(arm)
    if not isinstance(arm.file, ArmFile):
        raise ConfigurationError(
            arm.source,
            ["has no limits, controller and drives; a design needs a file as wam7.yaml is one"],
        )
    chosen = settled(design_settings({"time_s": time_s, **settings}))
    config = Path(arm.source)
    found = search_design(place_of(config, chosen.constraints), chosen, None, lambda best: None)
    return Designed(found, config, chosen.model_dump(mode="json", exclude_none=True))
