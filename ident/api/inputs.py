"""What the functions of the Python interface are given."""

import reprlib
from collections.abc import Callable, Sequence

from ident.api.arm import Arm
from ident.api.recording import Recording
from ident.regression.progress import Tell, silent
from wamctl.arm.errors import ConfigurationError, DataError, did_you_mean

_METHODS = ("regression", "simulation")
Progress = Callable[[str, float | None], None]


def checked_arm(arm: object) -> None:
    """Refuse what is no arm.

    Raises:
        DataError: it is something else.
    """
    if not isinstance(arm, Arm):
        raise DataError(
            f"arm is {reprlib.repr(arm)}, not an ident.Arm; Arm.from_urdf(path) or"
            " Arm.from_config(path) reads one."
        )


def checked(arm: Arm, recordings: Recording | Sequence[Recording]) -> list[Recording]:
    """One recording or several, as a list, with the arm's names of the joints.

    Raises:
        DataError: no recording, or something else where an arm or a recording is wanted.
    """
    checked_arm(arm)
    given = [recordings] if isinstance(recordings, Recording | str) else list(recordings)
    if not given:
        raise DataError("No recording was given; at least one is needed.")
    return [recorded(one, arm.joints) for one in given]


def by_simulation(method: str) -> bool:
    """Whether a method is that of the simulation, and not that of the regression.

    Raises:
        ConfigurationError: there is no such method.
    """
    if method not in _METHODS:
        near = did_you_mean(method, _METHODS) if isinstance(method, str) else ""
        choice = " or ".join(_METHODS)
        raise ConfigurationError("method", [f"{method!r} is neither {choice}{near}"])
    return method == "simulation"


def recorded(given: object, joints: Sequence[str]) -> Recording:
    """What was given, if it is a recording, with an arm's names of the joints.

    Raises:
        DataError: it is something else.
    """
    if isinstance(given, Recording):
        return given.named_as(joints)
    text = " ".join(reprlib.repr(given).split())
    raise DataError(
        f"{text} is not an ident.Recording; Recording.from_bag(path) reads one, and"
        " Recording(t, q, tau, joints=names) takes arrays."
    )


def told(progress: Progress | None) -> Tell:
    """A caller's function as the work calls it: the share that is done is often not known."""
    if progress is None:
        return silent
    return lambda what, share=None: progress(what, share)
