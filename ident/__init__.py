"""Identify a physically feasible model of an arm from its recordings."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ident.model.identified_model import Model
    from ident.model.model_file import load_model

__all__ = ["Model", "load_model"]


def __getattr__(name: str) -> Any:
    """Loads what is asked for, so that the command line starts without the libraries behind it."""
    if name == "load_model":
        from ident.model.model_file import load_model

        return load_model
    if name == "Model":
        from ident.model.identified_model import Model

        return Model
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
