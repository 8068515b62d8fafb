"""An identified model for other programs."""

from pathlib import Path

from ident.effects.bound_effects import checked_model
from ident.export.formats import WRITERS
from ident.model.identified_model import Model
from wamctl.arm.errors import DataError, did_you_mean, write_text


def export_model(model: Model, path: Path | str, to: str = "urdf") -> list[str]:
    """Write a model as `urdf`, `mjcf`, `c` or `python`.

    Args:
        model: an identified model.
        path: file to write.
        to: the format.

    Returns:
        What the format has no place for, one sentence each, with the torque that is missing.

    Raises:
        DataError: no model, an unknown format, or a file that cannot be written.
    """
    if to not in WRITERS:
        raise DataError(
            f"{to!r} is no format of an export; there are {', '.join(WRITERS)}"
            f"{did_you_mean(to, WRITERS) or '.'}"
        )
    write, left_out = WRITERS[to]
    model = checked_model(model)
    write_text(path, write(model))
    return left_out(model)
