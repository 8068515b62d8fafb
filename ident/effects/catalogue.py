"""The catalogue: every module of this package that holds an object named EFFECT."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

import ident.effects as package
from ident.effects.effect import Effect


@cache
def catalogue() -> dict[str, Effect]:
    """All effects by id, in alphabetical order."""
    modules = (
        import_module(f"{package.__name__}.{m.name}") for m in iter_modules(package.__path__)
    )
    effects = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {e.id: e for e in sorted(effects, key=lambda e: e.id)}
