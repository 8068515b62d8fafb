"""The smallest sizes that could have been named, and what the motion does not show."""

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import FOLDS
from ident.gap.regression.current_model import extend
from ident.gap.regression.sandwich import block_labels
from ident.gap.results.minimum_detectable import minimum_detectable
from ident.gap.results.smallest_size import model_on, without_others
from ident.gap.selection.candidates import all_candidates
from ident.gap.selection.estimates import final_estimates
from ident.recordings.dataset import in_memory


def test_columns_that_held_joints_make_alike_do_not_hide_the_first_one():
    columns = np.random.default_rng(0).normal(size=(50, 3))
    products = columns.T @ columns
    alone = without_others(products) @ products[0]
    assert alone == pytest.approx(1 / np.linalg.inv(columns.T @ columns)[0, 0])
    twice = np.column_stack([columns, columns[:, 2]])
    products = twice.T @ twice
    assert without_others(products) @ products[0] == pytest.approx(alone)


def detectable(found, name):
    return minimum_detectable(found).sizes.get(name, {})


def test_a_size_is_as_many_standard_errors_as_a_name_asks_for(nothing_hidden):
    """However little gain is asked for: a size may gain much and be one of two that trade."""
    settings, bar = nothing_hidden.options.settings, nothing_hidden.threshold
    easy = replace(nothing_hidden, threshold=replace(bar, gain=dict.fromkeys(bar.gain, 1e-9)))
    end, spring = nothing_hidden.end, catalogue()["joint_spring"].at((3,))
    beside = extend(nothing_hidden.rows, end, [spring])
    estimates = final_estimates(nothing_hidden.rows, beside, settings.significance)
    error = estimates.parameters[-1]["stiffness"].sd
    assert detectable(easy, "joint_spring")[3] > 0.9 * settings.naming.z * error


def test_the_standard_error_is_that_of_the_fit_with_the_effect(nothing_hidden):
    rows, end = nothing_hidden.rows, nothing_hidden.end
    gain = catalogue()["torque_gain"].at((1,))
    design = end.design(rows, [gain])
    columns = model_on(design, end.fit, range(FOLDS)).beside(design.accepted)
    asked = nothing_hidden.options.settings.significance
    told = final_estimates(rows, extend(rows, end, [gain]), asked).parameters[-1]["error"].sd
    error = columns.standard_error(block_labels(rows, design, asked.block_s)[:1])
    assert error == pytest.approx(told, rel=0.2)


def test_no_size_is_told_that_the_effect_cannot_have(nothing_hidden):
    bar = nothing_hidden.threshold
    hard = replace(nothing_hidden, threshold=replace(bar, gain=dict.fromkeys(bar.gain, 6.0)))
    highest = catalogue()["load_dependent_friction"].linear[0].upper
    sizes = detectable(nothing_hidden, "load_dependent_friction")
    assert sizes
    assert max(sizes.values()) <= highest
    assert set(detectable(hard, "load_dependent_friction")) < set(sizes)


def test_a_torque_below_the_resolution_of_the_record_is_not_seen(nothing_hidden):
    def rounded(s):
        return replace(s, tau=np.round(s.tau / 0.5) * 0.5)

    source = nothing_hidden.source
    coarse = [in_memory(d, d.rate_hz, [rounded(s) for s in d.segments]) for d in source.datasets]
    found = replace(nothing_hidden, source=replace(source, datasets=tuple(coarse)))
    assert detectable(nothing_hidden, "torque_offset")[3] < 0.2
    assert detectable(found, "torque_offset")[3] == pytest.approx(0.25)


def test_what_could_not_be_seen_and_what_could(nothing_hidden):
    seen = minimum_detectable(nothing_hidden)
    known = {h.effect for h in all_candidates(nothing_hidden.end.model.facts)}
    assert set(seen.sizes) | {e for e, j in seen.unobservable.items() if not j} >= known
    # a rotor about the vertical axis is the link's own inertia
    assert 0 in seen.unobservable["rotor_inertia"]
    assert seen.unobservable["payload"] == ()
    assert seen.unsearched == ()
    end = nothing_hidden.end
    facts = replace(end.model.facts, motor_from_joint=None)
    unknown = replace(end, model=replace(end.model, facts=facts))
    assert minimum_detectable(replace(nothing_hidden, end=unknown)).unsearched == ("torque_ripple",)
    sizes = seen.sizes["stribeck"]
    assert set(sizes) == set(range(7))
    assert all(0.0 < size < 1.0 for size in sizes.values())


def test_what_is_in_the_model_is_not_called_unobservable(nothing_hidden):
    """Its columns are all in the model, which is no lack of motion."""
    rows, start = nothing_hidden.rows, nothing_hidden.start
    spring, tilt = (catalogue()[name] for name in ("joint_spring", "gravity_tilt"))
    whole = next(iter(tilt.candidates(start.model.facts)))
    end = extend(rows, start, [spring.at((3,)), whole])
    seen = minimum_detectable(replace(nothing_hidden, end=end))
    assert 3 not in seen.unobservable.get("joint_spring", ())
    assert "gravity_tilt" not in seen.unobservable
