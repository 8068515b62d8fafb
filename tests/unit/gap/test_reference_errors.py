"""What a reference model does not know is in the intervals of what is found beside it."""

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.bound_effects import load_model
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import Experiment, facts_of, with_reference_model
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, extend, nominal_fit
from ident.gap.search import rows_of
from ident.gap.selection.gauss_newton import linearised, solution
from ident.identification.identify import identify, model_of
from ident.model.identified_model import Model
from wamctl.arm.errors import DataError


@pytest.fixture(scope="module")
def known(source) -> Model:
    return model_of(identify(source.datasets, source.arm))


@pytest.fixture(scope="module")
def fitted(source, known) -> CurrentFit:
    """The recording beside the model that it gave, with a payload."""
    beside = replace(source, reference_model=known)
    rows, facts = rows_of(beside, Options()), facts_of(beside)
    payload = catalogue()["payload"].candidates(facts)
    return extend(rows, nominal_fit(rows, facts), payload)


def payload_beside(
    source: Experiment, model: Model, fitted: CurrentFit, reported: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and first moment of a payload, and their variances, with the noise of the fit."""
    rows = rows_of(replace(source, reference_model=model), Options())
    at = linearised(rows, fitted, fitted.accepted, [()])
    at = replace(at, fit=replace(at.fit, sigma=fitted.fit.sigma))
    x, variances = solution(rows, at, 1.0, reported)
    return x[-4:], variances[-4:]


def test_the_covariance_grows_by_what_the_references_errors_do(source, known, fitted):
    certain = replace(known, errors=np.zeros((0, 0)))
    values, least = payload_beside(source, certain, fitted)
    some = replace(known, errors=known.errors[:, :4])
    more = payload_beside(source, some, fitted)[1] - least
    friction = [p.kind in ("fv", "fc") for p in known.parameters]
    moves = []
    for error in some.errors.T:
        wrong = replace(certain, delta=known.delta + np.where(friction, 0.0, error))
        moves.append(payload_beside(source, wrong, fitted, reported=True)[0] - values)
    assert more == pytest.approx(np.sum(np.square(moves), axis=0), rel=0.02)
    assert (payload_beside(source, known, fitted)[1] > 1.3 * least).all()


def test_errors_beside_a_reference_are_those_of_the_measured_torque(source, known):
    beside = replace(source, reference_model=known)
    plain, less = (rows_of(s, Options()) for s in (source, beside))
    measured = plain.torque.std(axis=0)
    np.testing.assert_allclose(less.measured_torque.std(axis=0), measured, rtol=0.1)
    assert less.torque.std() < 0.5 * less.measured_torque.std()


def test_a_model_file_keeps_the_errors_of_the_fit(known, tmp_path):
    known.save(tmp_path / "model.yaml")
    again = load_model(tmp_path / "model.yaml")
    assert again.errors == pytest.approx(known.errors, rel=1e-3)
    lengths = np.linalg.norm(again.errors, axis=1)
    assert lengths[lengths > 0] == pytest.approx([b.sd for b in known.base_parameters], rel=1e-3)


def test_a_model_file_without_errors_is_read(known, tmp_path):
    replace(known, errors=np.zeros((0, 0))).save(tmp_path / "model.yaml")
    assert "errors" not in (tmp_path / "model.yaml").read_text()
    assert not load_model(tmp_path / "model.yaml").errors.any()


@pytest.mark.parametrize(("again", "least", "most"), [(True, 1.6, 2.8), (False, 1.0, 1.5)])
def test_what_comes_again_in_each_period_counts_once(source, known, fitted, again, least, most):
    """Errors of two periods that are alike have twice the variance of errors that are not."""
    rows = rows_of(replace(source, reference_model=known), Options())
    pattern = np.random.default_rng(4).normal(size=rows.torque.shape)
    pattern *= fitted.fit.sigma.max(axis=1)
    wrong = pattern[rows.first_pass] if again else pattern
    nothing = np.zeros((len(wrong), 7, 0))
    rows = replace(rows, torque=rows.torque + 3.0 * wrong, parameter_errors=nothing)
    at = linearised(rows, fitted, fitted.accepted, [()])
    alone, systematic = (solution(rows, at, 0.4, s)[1][-4:] for s in (False, True))
    assert least <= np.mean(systematic / alone) < most


def unknown(model: Model, name: str, wrong: float = 0.0) -> Model:
    """The model as of recordings that do not show one of its parameters."""
    place = [p.name for p in model.parameters].index(name)
    delta, errors = model.delta.copy(), model.errors.copy()
    delta[place] += wrong
    errors[place, 0] = np.inf
    return replace(model, delta=delta, errors=errors)


def test_a_parameter_that_stood_in_no_row_of_its_fit_is_fitted_again(source, known, fitted):
    """Its value was taken as certain, whatever it was."""
    free, wrong = unknown(known, "l7x"), unknown(known, "l7x", 0.05)
    values, variances = payload_beside(source, free, fitted, reported=True)
    again, same = payload_beside(source, wrong, fitted, reported=True)
    assert np.abs(again - values).max() < 1e-6
    assert same == pytest.approx(variances, rel=1e-3)
    assert np.isinf(variances).tolist() == [False, True, False, False]


def test_what_stood_in_no_row_is_told_by_the_model_file(known, tmp_path):
    unknown(known, "l7x").save(tmp_path / "model.yaml")
    again = load_model(tmp_path / "model.yaml")
    assert again.undetermined.tolist() == [66]
    assert known.undetermined.tolist() == []


def test_a_joint_that_was_held_in_the_references_recordings_is_refused(source, known):
    held = replace(known, moving=np.arange(7) != 4)
    with pytest.raises(DataError) as refusal:
        with_reference_model(source, held)
    assert str(refusal.value) == (
        f"{source.datasets[0].name} moves wam/wrist_yaw_joint, held in the recordings that the"
        " model was fitted on: fit recordings that move it as well, or give one that does not."
    )


def test_a_model_is_not_surer_of_its_torque_than_on_stretches_it_has_not_seen(source):
    found = identify(source.datasets, source.arm)
    fitted = found.assessments[found.chosen].filtered.rms_by_joint
    unseen = found.held_out[found.chosen].errors.rms_by_joint
    assert (unseen > fitted).any()
    np.testing.assert_allclose(model_of(found).noise, np.fmax(fitted, unseen))
