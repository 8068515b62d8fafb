"""Forms of an effect that positions hardly tell apart, and what they leave open of its size.

Stribeck friction falls with speed as a bell, or from a peak at rest (exponents of 0.5 to 2:
Armstrong-Helouvry, Dupont, Canudas de Wit 1994). Near rest, where these differ most, servos stick
and encoders show no motion: the size at rest is known no better than the form is. Friction by the
link's load and by the driving side's differ wherever something moves: what fits worse is out.
"""

from collections.abc import Sequence

import numpy as np

from ident.output_error.fit import Fit, fit
from ident.output_error.parameters import ROW
from ident.output_error.search.parts import Part
from ident.output_error.search.settings import SearchSettings
from ident.output_error.setup import Prior, Setup
from ident.regression.progress import Tell
from ident.signals.arrays import Array

_ROUNDS = 15
_RECTANGLE = 3**-0.5  # standard deviation of what lies anywhere within one (JCGM 100:2008, 4.3.7)


def middle_form(
    setup: Setup, prior: Prior, found: Fit, effects: Sequence[tuple[Part, int]],
    settings: SearchSettings, tell: Tell,
) -> tuple[Fit, Array]:  # fmt: skip
    """The fit with the middle one of each effect's likely forms, and how far forms move its size.

    Args:
        setup: arm and recordings.
        prior: what is believed of the settings.
        found: fit of all recordings.
        effects: of the arm, and their joints.
        settings: which forms fit alike, and which are near.
        tell: hears what is being done.

    Returns:
        fit, and standard deviations in the settings' units, shape (quantities, n).
    """
    spread = np.zeros(found.settings.shape)
    for part, joint in effects:
        if not part.forms:
            continue
        tell(f"trying the forms of {part.name.replace('_', ' ')}")
        tried = []
        for form in part.forms:
            began = found.settings.copy()
            began[ROW[part.form], joint] = form
            tried.append(fit(setup, began, found.free, prior, _ROUNDS))
        least = min(one.cost for one in tried)
        alike = [one for one in tried if one.cost <= least + settings.alike_forms]
        found = alike[(len(alike) - 1) // 2]
        row, most = ROW[part.quantities[0]], np.exp(settings.near_forms) * found.rms[joint]
        near = alike if part.unlike else [one for one in tried if one.rms[joint] <= most]
        sizes = [one.settings[row, joint] for one in near]
        away = np.abs(np.array(sizes) - found.settings[row, joint])
        spread[row, joint] = _RECTANGLE * away.max()
    return found, spread
