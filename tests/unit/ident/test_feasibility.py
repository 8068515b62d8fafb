"""The feasible set and the feasible fit, against a modelling language and against certificates."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.estimation.entropic import entropic_path
from ident.estimation.feasible_sdp import feasible, nearest_to_cad
from ident.estimation.feasible_set import (
    Constraint,
    feasible_set,
    link_matrix_map,
    link_places,
    links_of,
    packed,
    paper_matrix,
    smallest_eigenvalue,
    unpacked,
)
from ident.estimation.problem import ordinary, with_beta
from ident.estimation.readable_sdp import feasible_program
from ident.estimation.regression_data import RegressionData, reduce_recordings
from ident.identification.feasibility_test import positive_fraction, proves_possible, verdict
from ident.recordings.dataset import dataset
from ident.regression.triangles import squared_error
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.inertial import pseudo_inertia


@pytest.fixture(scope="module")
def evidence(wam, noisy) -> RegressionData:
    return reduce_recordings([dataset(noisy, wam.arm.robot.joint_names, "log")], wam.arm)


def dissipative(evidence):
    """Places of friction and rotor inertia."""
    return [i for i, p in enumerate(evidence.base.parameters) if p.kind in ("fv", "fc", "ia")]


@given(st.lists(st.floats(-5, 5), min_size=20, max_size=20), st.sampled_from([3, 4, 6]))
@settings(max_examples=30)
def test_packing_keeps_inner_products(numbers, side):
    rng = np.random.default_rng(abs(hash(tuple(numbers))) % 2**32)
    a, b = (m + m.T for m in rng.normal(size=(2, side, side)))
    assert packed(a) @ packed(b) == pytest.approx(np.trace(a @ b))
    np.testing.assert_allclose(unpacked(packed(a), side), a)


@pytest.mark.parametrize(
    ("form", "of"), [("pseudo_inertia", pseudo_inertia), ("paper", paper_matrix)]
)
def test_link_maps_are_the_matrices(form, of):
    delta = np.random.default_rng(0).normal(size=10)
    matrix, side = link_matrix_map(form)
    np.testing.assert_allclose(unpacked(matrix @ delta, side), of(delta))


def test_paper_form_lacks_the_triangle_inequality():
    """A link with principal moments 1, 1, 3 has positive definite L, but no mass lies like that."""
    impossible = np.array([1.0, 0, 0, 1.0, 0, 3.0, 0, 0, 0, 1.0])
    assert np.linalg.eigvalsh(paper_matrix(impossible))[0] > 0
    assert np.linalg.eigvalsh(pseudo_inertia(impossible))[0] < 0


@pytest.mark.parametrize("form", ["pseudo_inertia", "paper"])
def test_fit_equals_problem_44_in_a_modelling_language(evidence, form):
    problem = evidence.problem()
    constraints = feasible_set(evidence.base.parameters, evidence.sizes, form)
    found = feasible(replace(problem, constraints=constraints))
    u = squared_error(problem.R, found.beta)
    assert u == pytest.approx(oracle(evidence, form), rel=1e-5)


def oracle(evidence: RegressionData, form: str) -> float:
    """u of (44), with U of (43) and E of (24)-(26) written out; only the scale differs."""
    base, problem = evidence.base, evidence.problem()
    parameters = base.parameters
    beta = ordinary(problem)
    least = squared_error(problem.R, beta)
    unit = np.array([0.01 if p.unit == "kg m^2" else 0.1 for p in parameters])
    delta = cp.multiply(unit, cp.Variable(len(parameters)))
    u = cp.Variable()
    R1 = problem.R[:-1, :-1]
    rho = (R1 @ beta - R1 @ base.K @ delta) / np.sqrt(least)
    size = len(R1)
    column = cp.reshape(rho, (size, 1), order="C")
    U = cp.bmat([[cp.reshape(u, (1, 1), order="C"), column.T], [column, np.eye(size)]])
    limits = [U >> 0]
    matrix, side = link_matrix_map(form)
    for link in links_of(parameters):
        link_delta = delta[link_places(parameters, link)]
        parts = [unpacked(column, side) for column in matrix.T]
        E = sum(link_delta[k] * parts[k] for k in range(10))
        limits.append(E >> 1e-12 * np.eye(side))
    limits += [delta[i] >= 1e-6 for i, p in enumerate(parameters) if p.kind != "inertial"]
    limits.append(cp.abs(delta) <= 3000)
    enough = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-7)
    cp.Problem(cp.Minimize(u), limits).solve(solver=cp.CLARABEL, **enough)
    return float(least * (1 + u.value))


def test_feasible_fit_is_possible_and_hardly_worse(evidence):
    problem = evidence.problem()
    found = feasible(problem)
    assert smallest_eigenvalue(found.delta, evidence.base.parameters) > 0
    assert found.delta[dissipative(evidence)].min() >= 0
    least = squared_error(problem.R, ordinary(problem))
    assert least < squared_error(problem.R, found.beta) < 1.1 * least
    assert found.active
    assert found.active[0].multiplier > 0
    assert "no extent along" in found.active[0].direction or found.active[0].direction


def test_a_multiplier_says_what_a_lower_bound_would_bring(evidence):
    """d u / d bound, by moving the bound on a friction parameter that is made to bind."""
    problem = evidence.problem()
    names = [p.name for p in evidence.base.parameters]
    unit = np.eye(len(names))[names.index("fc2")][None]

    def bounded(at):
        extra = Constraint(2, "fc2 high", 0, unit, np.array([at]))
        return feasible(replace(problem, constraints=[*problem.constraints, extra]))

    found = bounded(1.0)
    (active,) = [a for a in found.active if a.constraint == "fc2 high"]
    step = 1e-3
    lower = bounded(1.0 - step)
    change = squared_error(problem.R, found.beta) - squared_error(problem.R, lower.beta)
    assert active.multiplier == pytest.approx(change / step, rel=0.01)


def test_cad_is_feasible_and_ols_comes_with_a_proof_that_it_is_not(wam, evidence):
    base, prior, sizes = evidence.base, evidence.prior, evidence.sizes
    drawn = verdict(base, base.K @ prior, prior, sizes)
    assert drawn.feasible
    assert drawn.smallest_eigenvalue > 0
    beta = ordinary(evidence.problem())
    found = verdict(base, beta, prior, sizes)
    assert not found.feasible
    assert found.margin < 0
    assert found.smallest_eigenvalue < 0
    assert found.certificate @ beta < 0
    rng = np.random.default_rng(0)
    for _ in range(200):  # every possible arm lies on the other side
        links = [random_link(rng, *vars(sizes[k]).values()) for k in links_of(base.parameters)]
        delta = np.concatenate([np.r_[link, 0.0, 0.0] for link in links])
        assert found.certificate @ (base.K @ delta) > 0


def test_an_arm_far_from_possible_gets_a_verdict(evidence):
    """The solver's own scaling called this one without solution: margins can always be had."""
    base, prior, sizes = evidence.base, evidence.prior, evidence.sizes
    rng, beta = np.random.default_rng(293), base.K @ prior
    beta *= 1 + 10 ** rng.uniform(-2, 1.5) * rng.normal(size=beta.shape)
    beta += 10 ** rng.uniform(-4, 0.5) * rng.normal(size=beta.shape)
    found = verdict(base, beta, prior, sizes)
    assert not found.feasible
    assert found.certificate @ beta < 0


def random_link(rng, mass, radius):
    root = rng.normal(size=(4, 4)) * np.sqrt(mass) * np.array([radius] * 3 + [1.0])[:, None]
    p = root @ root.T
    sigma = p[:3, :3]
    tensor = np.trace(sigma) * np.eye(3) - sigma
    return np.r_[tensor[np.triu_indices(3)], p[:3, 3], p[3, 3]]


def test_negative_friction_is_named(evidence):
    base, prior, sizes = evidence.base, evidence.prior, evidence.sizes
    beta = base.K @ prior
    beta[base.names.index("fc5")] = -0.058760  # as in the feasible column of Table I
    found = verdict(base, beta, prior, sizes)
    assert found.negative == ("fc5",)
    assert not found.feasible


def test_the_mass_matrix_agrees_over_the_whole_range(wam, evidence):
    moving = np.ones(7, dtype=bool)

    def fraction(beta):
        delta = with_beta(evidence.base, evidence.prior, beta)
        return positive_fraction(wam.arm.robot, wam.arm.terms, evidence.base, delta, moving)

    assert fraction(evidence.base.K @ evidence.prior) == 1.0
    assert fraction(feasible(evidence.problem()).beta) == 1.0
    assert fraction(ordinary(evidence.problem())) < 0.9


def test_cad_decides_what_the_data_leave_open(evidence):
    problem = evidence.problem()
    found = feasible(problem)
    near = nearest_to_cad(problem, found)
    u = squared_error(problem.R, near.beta)
    assert u == pytest.approx(squared_error(problem.R, found.beta), rel=2e-3)
    assert smallest_eigenvalue(near.delta, evidence.base.parameters) > 0
    mass = link_places(evidence.base.parameters, 1)[9]  # no torque depends on it
    assert near.delta[mass] == pytest.approx(evidence.prior[mass], rel=0.05)


def test_entropic_prior_leads_from_cad_to_the_data(wam, evidence):
    problem = evidence.problem()
    path = entropic_path(problem)
    errors = [squared_error(problem.R, e.beta) for e in path]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1.05 * squared_error(problem.R, ordinary(problem))
    for estimate in path:
        assert smallest_eigenvalue(estimate.delta, evidence.base.parameters) > 0
        assert estimate.delta[dissipative(evidence)].min() >= 0


def test_bounds_on_mass_and_its_centre_hold(wam, noisy):
    boxes = [[[-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]]] * 7
    arm = wam.arm.with_settings(total_mass_kg=20.0, center_of_mass_box_m=boxes, cad_spread=0.3)
    evidence = reduce_recordings([dataset(noisy, arm.robot.joint_names, "log")], arm)
    delta = feasible(evidence.problem()).delta
    links = delta.reshape(7, 12)[:, :10]
    assert links[:, 9].sum() < 20.0 + 1e-6
    assert (np.abs(links[:, 6:9] / links[:, 9:]) < 0.3 + 1e-6).all()
    drawn = evidence.prior.reshape(7, 12)[:, 9]
    assert (np.abs(links[:, 9] / drawn - 1) < 0.3 + 1e-6).all()


def test_boxes_for_the_wrong_number_of_links_are_refused(wam, noisy):
    arm = wam.arm.with_settings(center_of_mass_box_m=[[[0, 0, 0], [1, 1, 1]]])
    with pytest.raises(ConfigurationError) as caught:
        reduce_recordings([dataset(noisy, arm.robot.joint_names, "log")], arm)
    assert str(caught.value) == (
        "identification.center_of_mass_box_m: 1 boxes for 7 links; give two corners of three"
        " numbers each."
    )


@pytest.mark.parametrize(("solver", "equal"), [("CLARABEL", 5e-6), ("SCS", 1e-3)])
def test_the_readable_program_gives_what_the_direct_path_gives(evidence, solver, equal):
    """The same error, in units of the least error; and nearly the same prediction."""
    problem = evidence.problem()
    direct, read = feasible(problem), feasible_program(problem).solve(solver)
    least = squared_error(problem.R, ordinary(problem))
    errors = [squared_error(problem.R, e.beta) / least for e in (direct, read)]
    assert errors[1] == pytest.approx(errors[0], abs=equal)
    change = problem.R[:-1, :-1] @ (read.beta - direct.beta)
    assert np.linalg.norm(change) < np.sqrt(equal * least)


def test_a_constraint_and_a_prior_of_ones_own_in_three_lines(evidence):
    program = feasible_program(evidence.problem())
    light = program.subject_to(program.parameter("m2") <= 3.0, program.parameter("fc4") >= 1.7)
    found = light.with_prior(1e-6 * cp.sum_squares(light.parameter("m7"))).solve()
    values = dict(zip([p.name for p in evidence.base.parameters], found.delta, strict=True))
    assert values["m2"] <= 3.0 + 1e-6
    assert values["fc4"] >= 1.7 - 1e-6
    free = program.solve()
    assert not np.allclose(found.beta, free.beta)


def test_a_solver_or_parameter_that_is_not_there_is_refused(evidence):
    program = feasible_program(evidence.problem())
    with pytest.raises(ConfigurationError, match=r"NOBODY is not installed; there are .*CLARABEL"):
        program.solve("NOBODY")
    with pytest.raises(DataError, match="There is no parameter mass4; there are L1xx"):
        program.parameter("mass4")


def test_parameters_of_a_possible_arm_prove_it_whatever_a_solver_says(evidence):
    """On the boundary the margin of the test is rounding, of either sign."""
    base, parameters = evidence.base, evidence.base.parameters
    delta = evidence.prior.copy()
    assert proves_possible(delta, base)
    for kind in ("inertial", "fv"):
        wrong = delta.copy()
        wrong[next(i for i, p in enumerate(parameters) if p.kind == kind)] = -1.0
        assert not proves_possible(wrong, base)
