"""Friction over speed, correlations, and effects as curves, from planted ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.gap.data.noise_regions import Region
from ident.identification.standard_errors import QUANTILE_90
from ident.report.gap.effect_curve import OWN_TORQUE, EffectCurve, effect_curve
from ident.report.run_curves import correlation, friction_curves

ROWS = 4000


@pytest.fixture(scope="module")
def run() -> Any:
    """One joint of inertia 2, viscous friction 0.3, and Coulomb friction 0.5."""
    rng = np.random.default_rng(3)
    speed, acceleration = np.sin(np.arange(ROWS) / 50.0), rng.normal(size=ROWS)
    W = np.stack([acceleration, speed, np.sign(speed)], axis=1)[:, None, :]
    beta = np.array([2.0, 0.3, 0.5])
    excerpt = SimpleNamespace(speed=speed[:, None], W=W, tau=W @ beta)
    kept = [SimpleNamespace(kind=k, index=1) for k in ("inertial", "fv", "fc")]
    R = np.linalg.qr(np.column_stack([W[:, 0], W[:, 0] @ beta]), mode="r")
    return SimpleNamespace(
        evidence=SimpleNamespace(
            base=SimpleNamespace(kept_parameters=kept),
            moving=np.array([True]),
            logs=[SimpleNamespace(reduction=SimpleNamespace(excerpt=excerpt))],
            problem=lambda: SimpleNamespace(R=R),
        ),
        estimates={"feasible": SimpleNamespace(beta=beta)},
        chosen="feasible",
        sd=np.array([0.1, 0.02, 0.01]),
    )


def test_friction_is_what_the_links_leave(run: Any) -> None:
    (curve,) = friction_curves(run, correlation(run))
    assert curve.joint == 0
    assert np.all(np.diff(curve.speed) > 0)
    sliding = curve.speed != 0.0
    expected = 0.3 * curve.speed + 0.5 * np.sign(curve.speed)
    np.testing.assert_allclose(curve.model, expected)
    np.testing.assert_allclose(curve.measured[sliding], expected[sliding], atol=1e-9)
    assert np.isnan(curve.measured[~sliding]).all()


def test_the_band_knows_that_parameters_hang_together(run: Any) -> None:
    tied = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -0.9], [0.0, -0.9, 1.0]])
    (curve,) = friction_curves(run, tied)
    v = curve.speed[-1]
    variance = (0.02 * v) ** 2 + 0.01**2 - 2 * 0.9 * 0.02 * v * 0.01
    assert curve.half_width[-1] == pytest.approx(QUANTILE_90 * np.sqrt(variance))


def test_correlation_is_that_of_the_covariance(run: Any) -> None:
    R = run.evidence.problem().R[:-1, :-1]
    covariance = np.linalg.inv(R.T @ R)
    size = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(correlation(run), covariance / np.outer(size, size), atol=1e-9)


def curve_of(
    torque: np.ndarray,
    motion: dict[str, np.ndarray],
    slides: bool = True,
    prismatic: bool = False,
) -> EffectCurve:
    """Of an effect of one joint, beside noise, with half of the rows at rest, or all of them."""
    chain = SimpleNamespace(sliding=np.array([prismatic]))
    rng = np.random.default_rng(5)
    rows = len(torque)
    noise = 0.001 * rng.normal(size=rows)
    region = np.where(slides & (np.arange(rows) % 2), Region.SLIDING, Region.REVERSAL)
    after = SimpleNamespace(values=np.where(region == Region.SLIDING, noise, 50.0), region=region)
    before = SimpleNamespace(values=after.values + torque, region=region)
    segment = SimpleNamespace(**{k: v[:, None] for k, v in motion.items()})
    found = SimpleNamespace(
        rows=SimpleNamespace(blocks=SimpleNamespace(means=lambda samples: samples(segment))),
        end=SimpleNamespace(
            fit=SimpleNamespace(effects=[np.array([1.0])]),
            model=SimpleNamespace(facts=SimpleNamespace(motor_from_joint=None, chain=chain)),
        ),
    )
    design = SimpleNamespace(
        t=np.arange(float(rows)),
        index=[SimpleNamespace(joints=(0,))],
        effect_columns=lambda index, joint: torque[:, None],
        columns=[np.column_stack([np.zeros(rows), torque, rng.normal(size=rows)])],
    )
    both: Any = SimpleNamespace(design=design, before=[before], after=[after])
    return effect_curve(found, both, 0, 0)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def motion() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(4)
    return {k: rng.uniform(-1.0, 1.0, ROWS) for k in ("q", "qd", "qdd")}


def test_a_low_speed_effect_shows_at_low_speed(motion: dict[str, np.ndarray]) -> None:
    speed = motion["qd"]
    curve = curve_of(np.sign(speed) * np.exp(-np.abs(speed) / 0.1), motion)
    assert curve.variable == "speed [rad/s]"
    known = np.isfinite(curve.effect)
    assert (~known).sum() == 1  # the two directions are two curves
    x, effect, measured = curve.x[known], curve.effect[known], curve.measured[known]
    assert np.all(np.diff(x) > 0)
    np.testing.assert_allclose(measured, effect, atol=0.002)  # rows at rest do not count
    np.testing.assert_allclose(effect, np.sign(x) * np.exp(-np.abs(x) / 0.1), atol=0.1)
    assert np.abs(x[np.abs(effect) > 0.5]).max() < 0.1
    assert curve.before[known].max() > 100 * curve.after[known].max()
    assert "at a speed below 0.08" in curve.where


def test_a_spring_is_drawn_over_position(motion: dict[str, np.ndarray]) -> None:
    assert curve_of(2.0 * motion["q"], motion).variable == "position [rad]"


def test_a_joint_that_slides_has_metres_and_newtons(motion: dict[str, np.ndarray]) -> None:
    curve = curve_of(2.0 * motion["q"], motion, prismatic=True)
    assert (curve.variable, curve.unit) == ("position [m]", "N")


def test_an_effect_of_several_quantities_is_drawn_over_itself(
    motion: dict[str, np.ndarray],
) -> None:
    curve = curve_of(motion["q"] * motion["qd"] * motion["qdd"], motion)
    assert curve.variable == OWN_TORQUE
    np.testing.assert_allclose(curve.x, curve.effect)


def test_a_constant_torque_is_drawn_over_time(motion: dict[str, np.ndarray]) -> None:
    curve = curve_of(np.full(ROWS, 0.7), motion)
    assert (curve.variable, curve.where) == ("time [s]", "")
    np.testing.assert_allclose(curve.effect, 0.7)


def test_at_a_joint_that_never_slides_all_rows_are_drawn(motion: dict[str, np.ndarray]) -> None:
    curve = curve_of(2.0 * motion["q"], motion, slides=False)
    assert curve.variable == "position [rad]"
    np.testing.assert_allclose(curve.effect, 2.0 * curve.x, atol=0.01)
