"""Identify a physically feasible model of an arm from its recordings."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ident.model.identified_model import Model
    from ident.model.model_file import load_model
    from ident.workflows.simulate import simulate

__all__ = ["Model", "load_model", "simulate"]

_HOMES = {
    "Model": "ident.model.identified_model",
    "load_model": "ident.model.model_file",
    "simulate": "ident.workflows.simulate",
}


def __getattr__(name: str) -> Any:
    """Loads what is asked for, so that the command line starts without the libraries behind it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
