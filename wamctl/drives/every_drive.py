"""One step of the set-up for every drive, with all their faults told together."""

from collections.abc import Callable, Sequence

from wamctl.drives.bus import Channel
from wamctl.errors import BusError, DrivesError, SilentDriveError


def for_every_drive(
    names: Sequence[str], step: Callable[[int], None], channel: Channel, between: str = ": "
) -> None:
    """Take a step for every drive, whatever the others do.

    Args:
        names: of the drives, for messages.
        step: called with the drive's place in `names`.
        channel: the bus.
        between: what stands between a drive's name and its fault.

    Raises:
        DrivesError: all that went wrong.
    """
    errors: dict[str, BusError] = {}
    for place, name in enumerate(names):
        try:
            step(place)
        except BusError as error:
            errors[name] = error
    if errors:
        silent = sum(isinstance(e, SilentDriveError) for e in errors.values())
        faults = [f"{name}{between}{error}" for name, error in errors.items()]
        raise DrivesError(str(channel), faults, nobody=silent == len(names))
