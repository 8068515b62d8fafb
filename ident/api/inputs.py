"""What the functions of the Python interface are given."""

from collections.abc import Sequence

from ident.api.arm import Arm
from ident.api.recording import Recording
from wamctl.arm.errors import DataError


def checked(arm: Arm, recordings: Recording | Sequence[Recording]) -> list[Recording]:
    """One recording or several, as a list.

    Raises:
        DataError: no recording, or something else where an arm or a recording is wanted.
    """
    if not isinstance(arm, Arm):
        raise DataError(
            f"arm is {arm!r}, not an ident.Arm; Arm.from_urdf(path) or Arm.from_config(path)"
            " reads one."
        )
    given = [recordings] if isinstance(recordings, Recording | str) else list(recordings)
    if not given:
        raise DataError("No recording was given; at least one is needed.")
    for other in given:
        if not isinstance(other, Recording):
            raise DataError(
                f"{other!r} is not an ident.Recording; Recording.from_bag(path) reads one, and"
                " Recording(t, q, tau, joints=names) takes arrays."
            )
    return given
