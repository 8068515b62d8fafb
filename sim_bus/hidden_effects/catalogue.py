"""All hidden effects, and the file that names them."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from sim_bus.hidden_effects import body, drive_train, friction, outside_catalogue, sensing
from sim_bus.plant.physics import Physics
from wamctl.arm.config import Section, read_yaml, validate
from wamctl.arm.errors import ConfigurationError

Known = friction.Effects | drive_train.Effects | body.Effects | sensing.Effects
"""Effects that the gap finder knows by name."""

OutsideCatalogue = outside_catalogue.Effects
"""Effects that nobody looks for, and that should be found without a name."""


class HiddenFile(Section):
    """A file of hidden effects.

    Attributes:
        summary: which effect, where, how large, in one line.
        effects: what the arm carries, in the order in which it acts.
    """

    summary: str = ""
    effects: tuple[Annotated[Known | OutsideCatalogue, Field(discriminator="effect")], ...]


def read_hidden_file(path: Path) -> HiddenFile:
    """The effects of a file, in its order.

    Raises:
        ConfigurationError: unreadable, or all its faults at once.
    """
    return validate(HiddenFile, read_yaml(path), path)


def hidden(physics: Physics, file: HiddenFile, seed: int, source: Path) -> Physics:
    """The same arm with the effects of a file in it.

    Raises:
        ConfigurationError: an effect that does not fit the arm.
    """
    for k, effect in enumerate(file.effects):
        try:
            physics = effect.hide(physics, seed)
        except ValueError as error:
            raise ConfigurationError(source, [f"effects.{k}.{effect.effect}: {error}"]) from error
    return physics
