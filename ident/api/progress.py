"""How a caller hears of the progress."""

from collections.abc import Callable

from ident.regression.progress import Tell, silent

Progress = Callable[[str, float | None], None]


def told(progress: Progress | None) -> Tell:
    """A caller's function as the work calls it: the share that is done is often not known."""
    if progress is None:
        return silent
    return lambda what, share=None: progress(what, share)
