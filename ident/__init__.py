"""Identify a physically feasible model of an arm from its recordings."""

import importlib
import importlib.metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ident.api.arm import Arm
    from ident.api.design import Designed, design
    from ident.api.export import export_model
    from ident.api.gap import Gap, find_gap
    from ident.api.identified import Identified, identify
    from ident.api.named import Effect
    from ident.api.recording import Recording
    from ident.api.score import Score, score
    from ident.effects.bound_effects import load_model
    from ident.model.identified_model import Model
    from ident.output_error.servo_model import load_servos
    from ident.workflows.simulate import simulate

    __version__: str

_HOMES = {
    "Arm": "ident.api.arm",
    "Designed": "ident.api.design",
    "Effect": "ident.api.named",
    "Gap": "ident.api.gap",
    "Identified": "ident.api.identified",
    "Model": "ident.model.identified_model",
    "Recording": "ident.api.recording",
    "Score": "ident.api.score",
    "design": "ident.api.design",
    "export_model": "ident.api.export",
    "find_gap": "ident.api.gap",
    "identify": "ident.api.identified",
    "score": "ident.api.score",
    "load_model": "ident.effects.bound_effects",
    "load_servos": "ident.output_error.servo_model",
    "simulate": "ident.workflows.simulate",
}

__all__ = [
    "Arm",
    "Designed",
    "Effect",
    "Gap",
    "Identified",
    "Model",
    "Recording",
    "Score",
    "design",
    "export_model",
    "find_gap",
    "identify",
    "load_model",
    "load_servos",
    "score",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Loads what is asked for, so that the command line starts without the libraries behind it."""
    if name == "__version__":
        return importlib.metadata.version("wam-ident")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted([*__all__, "__version__"])
