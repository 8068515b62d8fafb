"""An identified model for other programs."""

from pathlib import Path

from ident.effects.bound_effects import checked_model
from ident.export.formats import WRITERS
from ident.export.servos import isaaclab_settings, not_in_mjcf, servo_mjcf
from ident.model.identified_model import Model
from ident.output_error.servo_model import ServoModel
from wamctl.arm.errors import DataError, did_you_mean, write_text

_SERVOS = {"mjcf": servo_mjcf, "isaaclab": isaaclab_settings}


def export_model(model: Model | ServoModel, path: Path | str, to: str = "urdf") -> list[str]:
    """Write a model as `urdf`, `mjcf`, `c` or `python`; one of servos as `mjcf` or `isaaclab`.

    Args:
        model: an identified model.
        path: file to write.
        to: the format.

    Returns:
        What the format has no place for, one sentence each, with the torque that is missing.

    Raises:
        DataError: no model, an unknown format, or a file that cannot be written.
    """
    formats = _SERVOS if isinstance(model, ServoModel) else WRITERS
    if to not in formats:
        raise DataError(
            f"{to!r} is no format of an export; there are {', '.join(formats)}"
            f"{did_you_mean(to, formats) or '.'}"
        )
    if isinstance(model, ServoModel):
        write_text(path, _SERVOS[to](model))
        return not_in_mjcf(model) if to == "mjcf" else []
    write, left_out = WRITERS[to]
    model = checked_model(model)
    write_text(path, write(model))
    return left_out(model)
