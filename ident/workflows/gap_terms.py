"""Offsets and rotors that the written model holds as terms, beside what the search found."""

from collections.abc import Collection
from typing import Any

from ident.dynamics.parameters import KIND_OF_TERM
from ident.effects.catalogue import catalogue
from ident.gap.selection.state import Place
from ident.identification.standard_errors import standard_errors
from ident.workflows.gap_outcome import Written

Content = dict[str, Any]


def terms_content(written: Written, told: Collection[Place]) -> list[Content]:
    """`terms` of `gap.json`: one for each joint, as `ident run` fits them for all joints at once.

    A rotor that the motion does not tell from the links is left out.

    Args:
        written: the model, and what it was fitted to.
        told: places of the effects that are named or in the model without a name.
    """
    evidence = written.evidence
    if evidence is None:
        return []
    effects = {KIND_OF_TERM[e.usual_term]: e for e in catalogue().values() if e.usual_term}
    base, found = evidence.base, []
    errors = standard_errors(evidence)
    for place, p, name, sd in zip(base.kept, base.kept_parameters, base.names, errors, strict=True):
        effect = effects.get(p.kind)
        if effect is None or name != p.name or (effect.id, (p.index - 1,)) in told:
            continue
        size = effect.linear[0]
        value = {"value": float(written.model.delta[place]), "sd": float(sd), "unit": size.unit}
        found.append({"name": effect.id, "joints": [p.index], "parameters": {size.name: value}})
    return found
