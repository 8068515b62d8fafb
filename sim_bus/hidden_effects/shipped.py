"""The hidden effects that are shipped: one YAML file each, in `configs/hidden`."""

from difflib import get_close_matches
from pathlib import Path

from sim_bus.errors import UnknownEffectError
from sim_bus.hidden_effects.catalogue import read_hidden_file
from wamctl.arm.config import shipped_file

_FOLDER = "hidden"


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
