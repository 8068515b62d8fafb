"""All hidden effects, and the file that names them."""

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated

from pydantic import Field

from sim_bus.errors import UnknownEffectError
from sim_bus.hidden_effects import body, drive_train, friction, outside_catalogue, sensing
from sim_bus.plant.physics import Physics
from wamctl.arm.config import Section, read_yaml, shipped_file, validate
from wamctl.arm.errors import ConfigurationError

Known = friction.Effects | drive_train.Effects | body.Effects | sensing.Effects
"""Effects that the gap finder knows by name."""

OutsideCatalogue = outside_catalogue.Effects
"""Effects that nobody looks for, and that should be found without a name."""

_FOLDER = "hidden"


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


def hidden_file(name: str) -> Path:
    """The file of hidden effects: a path, or the bare name of a shipped one.

    Raises:
        UnknownEffectError: neither; the sentence lists the shipped names.
    """
    if Path(name).is_file():
        return Path(name)
    shipped = _shipped()
    if name in shipped:
        return shipped[name]
    alike = get_close_matches(name, shipped, n=1)
    guess = f" Did you mean {alike[0]}?" if alike else ""
    raise UnknownEffectError(
        f"--hidden got {name!r}, which is neither a file nor the name of a shipped effect.{guess} "
        f"Shipped: {', '.join(shipped)}."
    )


def shipped_summaries() -> dict[str, str]:
    """Joint and size of each shipped effect in one line, by its name."""
    return {name: read_hidden_file(path).summary for name, path in _shipped().items()}


def _shipped() -> dict[str, Path]:
    return {path.stem: path for path in sorted(shipped_file(_FOLDER).glob("*.yaml"))}
