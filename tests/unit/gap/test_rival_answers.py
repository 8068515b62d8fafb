"""Rival answers of an investigation are fitted alike."""

import numpy as np

from ident.effects.catalogue import catalogue
from ident.gap.options import Options
from ident.planning.hypotheses import NONE, Answer, hypotheses


def test_no_effect_is_fitted_to_as_much_data_as_an_effect(source):
    offset = catalogue()["torque_offset"].at((3,))
    answer = Answer({"verdict": "named", "effects": [], "suspected": []}, (offset,))
    found = {h.name: h for h in hypotheses(source, answer, Options(), lambda _: None)}
    nothing, extra = (np.diag(found[name].known.products) for name in (NONE, "torque_offset:4"))
    assert len(extra) == len(nothing) + 1
    np.testing.assert_allclose(nothing, extra[: len(nothing)], rtol=0.1)
