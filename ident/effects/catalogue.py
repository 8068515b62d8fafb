"""The catalogue: the effects of this package, and those that other packages bring.

Another package brings an effect by an entry point of the group `ident.effects` that names an object
of `Effect`.
"""

from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pkgutil import iter_modules

import ident.effects as package
from ident.effects.effect import Effect
from wamctl.arm.errors import DataError

GROUP = "ident.effects"


@cache
def catalogue() -> dict[str, Effect]:
    """All effects by id, in alphabetical order.

    Raises:
        DataError: an effect of another package that cannot be loaded, or whose id is taken.
    """
    effects = own_effects()
    for entry in sorted(entry_points(group=GROUP), key=lambda e: (e.name, e.value)):
        effect = _loaded(entry)
        if effect.id in effects:
            raise DataError(
                f"The effect {effect.id!r} of {entry.value} has an id that another effect has:"
                " give it its own."
            )
        effects[effect.id] = effect
    return dict(sorted(effects.items()))


def own_effects() -> dict[str, Effect]:
    """The effects of this package by id: of every module that holds an object named EFFECT."""
    modules = (
        import_module(f"{package.__name__}.{m.name}") for m in iter_modules(package.__path__)
    )
    effects = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {e.id: e for e in effects}


def _loaded(entry: EntryPoint) -> Effect:
    try:
        effect = entry.load()
    except Exception as error:  # another package's import may raise anything
        raise DataError(
            f"The effect {entry.name!r} cannot be loaded from {entry.value} ({error!r}): mend or"
            " uninstall the package that brings it."
        ) from error
    if not isinstance(effect, Effect):
        raise DataError(
            f"{entry.value}, which the entry point {entry.name!r} of the group {GROUP} names, is"
            f" a {type(effect).__name__}: it must be an object of ident.effects.effect.Effect."
        )
    return effect
