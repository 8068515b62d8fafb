"""What a reference model does not know is in the intervals of what is found beside it."""

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.bound_effects import load_model
from ident.effects.catalogue import catalogue
from ident.gap.data.experiment import Experiment, facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, extend, nominal_fit
from ident.gap.search import rows_of
from ident.gap.selection.gauss_newton import linearised, solution
from ident.identification.identify import identify, model_of
from ident.model.identified_model import Model


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
    source: Experiment, model: Model, fitted: CurrentFit
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and first moment of a payload, and their variances, with the noise of the fit."""
    rows = rows_of(replace(source, reference_model=model), Options())
    at = linearised(rows, fitted, fitted.accepted, [()])
    x, variances = solution(rows, replace(at, fit=replace(at.fit, sigma=fitted.fit.sigma)), 1.0)
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
        moves.append(payload_beside(source, wrong, fitted)[0] - values)
    assert more == pytest.approx(np.sum(np.square(moves), axis=0), rel=0.02)
    assert (payload_beside(source, known, fitted)[1] > 1.3 * least).all()


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
    pattern = np.random.default_rng(4).normal(size=np.concatenate(rows.torque).shape)
    pattern *= fitted.fit.sigma.max(axis=1)
    wrong = pattern[rows.first_pass] if again else pattern
    ends = np.cumsum([len(x) for x in rows.torque])[:-1]
    torque = [x + y for x, y in zip(rows.torque, np.split(3.0 * wrong, ends), strict=True)]
    rows = replace(rows, torque=tuple(torque), parameter_errors=(np.zeros((len(wrong), 7, 0)),))
    at = linearised(rows, fitted, fitted.accepted, [()])
    alone, systematic = (solution(rows, at, 0.4, s)[1][-4:] for s in (False, True))
    assert least <= np.mean(systematic / alone) < most
