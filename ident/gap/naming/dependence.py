"""Which named effects lean on each other: whose size changes without whom.

Two effects of one answer may share out what the data show, as the mass of a payload and the torque
constant of the joint that carries it. Each then stands beside the other only, and whoever knows
that one of them is not there must know what the other would be.
"""

from dataclasses import dataclass, replace

from ident.effects.candidate import Candidate, Value
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import FOLDS
from ident.gap.regression.current_model import CurrentFit
from ident.gap.regression.rows import WindowedRows
from ident.gap.regression.weighted_fit import fit
from ident.gap.selection.estimates import FinalEstimates
from ident.gap.settings import Naming
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Dependence:
    """A value that is another one without an effect that was named beside it.

    Attributes:
        parameter: its name.
        other: the effect that it leans on.
        without: what it would be without that effect.
        unit: SI.
    """

    parameter: str
    other: Candidate
    without: float
    unit: str


def dependences(
    rows: WindowedRows, end: CurrentFit, final: FinalEstimates, settings: Naming
) -> list[tuple[Dependence, ...]]:
    """For each effect of the final model, what it leans on.

    Args:
        rows: the rows.
        end: the model with all effects.
        final: their values.
        settings: from what change on an effect leans on another.
    """
    design = replace(end, accepted=final.effects).design(rows)
    equations, structure = design.equations.of(range(FOLDS)), final.fit.structure
    found: list[list[Dependence]] = [[] for _ in final.effects]
    for k, other in enumerate(final.effects):
        fewer = tuple(e for i, e in enumerate(structure.effects) if i != k)
        left = fit(equations, replace(structure, effects=fewer), final.fit.sigma).effects
        for i, theta in zip((i for i in range(len(found)) if i != k), left, strict=True):
            found[i] += _change(final.effects[i], final.parameters[i], theta, other, settings)
    return [tuple(f) for f in found]


def _change(
    h: Candidate, values: dict[str, Value], theta: Array, other: Candidate, settings: Naming
) -> list[Dependence]:
    """The value that changes most in its own standard deviations, if it changes much."""
    raw = {c.name: Value(float(x), 0.0, c.unit) for c, x in zip(h.coefficients, theta, strict=True)}
    without = catalogue()[h.effect].as_reported(h, raw)
    changes = {
        name: abs(without[name].value - v.value) / v.sd
        for name, v in values.items()
        if v.sd > 0.0
        and name in without
        and abs(without[name].value - v.value) > settings.leaning_share * abs(v.value)
    }
    name = max(changes, key=lambda n: changes[n], default="")
    if not name or changes[name] < settings.z:
        return []
    return [Dependence(name, other, without[name].value, values[name].unit)]
