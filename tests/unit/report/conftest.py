"""Small results with every field, made up."""

from typing import Any

import numpy as np
import pytest

from ident.report.charts import Curve, Panel, line_chart
from ident.report.design_page import DesignReport
from ident.report.figures import Trace
from ident.report.gap.report import GapReport
from ident.report.page import Figure, Table
from ident.report.run_curves import FrictionCurve
from ident.report.run_page import RunReport
from ident.report.style import WITH
from wamctl.arm.trajectory import FourierSeries, Trajectory, sample
from wamctl.arm.trajectory_check import Quantity


def errors(percent: float) -> dict[str, Any]:
    return {
        "mse": 1.23e-3 * percent,
        "relative_error_percent": percent,
        "relative_error_percent_by_joint": [1.5 * percent, 0.5 * percent, None],
        "rms_by_joint": [0.15 * percent, 0.05 * percent, None],
    }


def estimator(percent: float, feasible: bool) -> dict[str, Any]:
    return errors(percent) | {
        "feasible": feasible,
        "min_pseudo_inertia_eigenvalue": 1.7e-6 if feasible else -0.31,
        "mass_matrix_positive_fraction": 1.0 if feasible else 0.471,
        "negative": [] if feasible else ["fc1"],
        "raw_torque": errors(1.1 * percent),
        "held_out": errors(1.2 * percent) | {"relative_error_percent_sd": 0.037 * percent},
    }


@pytest.fixture(scope="session")
def run_content() -> dict[str, Any]:
    return {
        "arm": "bench <arm>",
        "estimator": "feasible",
        "samples": 30000,
        "rows": 18446,
        "joints": ["a/base_joint", "a/lift_joint", "a/slide_joint"],
        "torque_units": ["N m", "N m", "N"],
        "moving": [True, True, False],
        "logs": [
            {
                "name": "/data/one.mcap",
                "samples": 30000,
                "sample_rate_hz": 500.0,
                "torque": "commanded",
                "cutoff_hz": 2.5,
                "remarks": ["held: a/slide_joint"],
            }
        ],
        "sample_rate_hz": 500.0,
        "cutoff_hz": 2.5,
        "cutoff_from": "given",
        "culled_fraction": 0.1216,
        "velocity_threshold": 0.01,
        "rank": 3,
        "condition_number": 57.58987,
        "estimators": {
            "cad": estimator(26.0, feasible=True),
            "ols": estimator(0.73, feasible=False),
            "feasible": estimator(0.74, feasible=True),
        },
        "base_parameters": [
            {
                "name": "L1yy + L2zz",
                "cad": 0.1328,
                "ols": 0.14451,
                "sd": 0.0035,
                "feasible": 0.1437,
                "unit": "kg m^2",
            },
            {
                "name": "fc1",
                "cad": None,
                "ols": -0.0123,
                "sd": 0.044,
                "feasible": 1e-6,
                "unit": "N m",
            },
        ],
        "active_constraints": [
            {"joint": 1, "constraint": "fc >= 0", "multiplier": 12.3},
            {
                "joint": 2,
                "constraint": "pseudo-inertia >= 0",
                "multiplier": 0.5,
                "direction": "no mass left",
            },
        ],
        "delays": [{"seconds": 0.00071, "sd": 0.00012}],
        "terms_tried": [
            {"term": "offset", "gain_percent": 0.55, "sd_percent": 0.09, "taken": True},
            {"term": "rotor_inertia", "gain_percent": -0.02, "sd_percent": 0.01, "taken": False},
        ],
        "not_identified": {
            "without_effect": ["L1xx", "m1"],
            "only_combined": ["L1yy", "L2zz"],
            "invisible": ["fc1"],
            "hardly_told_apart": [["L1yy + L2zz", "fc1"]],
        },
        "culling": {
            "thresholds_rad_s": [0.0, 0.01, 0.02],
            "removed": [0.0, 0.1, 0.2],
            "automatic_choice_rad_s": 0.01,
            "slow": {"condition_number": [57.0, 57.5, 58.0], "mse": [3e-3, 2e-3, 1.5e-3]},
            "random": {"condition_number": [57.0, 57.6, 58.2], "mse": [3e-3, 3e-3, 3.1e-3]},
            "other": {"condition_number": [57.0, 60.0, 63.0], "mse": [3e-3, 3.2e-3, 3.3e-3]},
        },
        "solver": {"name": "Clarabel", "status": "Solved", "seconds": 0.11},
        "seconds": {"read": 0.5, "filter": 0.2, "regressor": 0.7, "solve": 0.8},
        "provenance": {
            "program": {"wam-ident": "0.1.0", "commit": "abc"},
            "arm": {"name": "bench"},
            "logs": {"/data/one.mcap": "6af7"},
            "settings": {"cutoff_hz": None, "filter_order": 3, "terms": ["viscous"]},
        },
    }


@pytest.fixture(scope="session")
def trace() -> Trace:
    samples = 2000
    t = np.linspace(0.0, 60.0, samples)
    measured = np.stack([np.sin(t), 0.1 * np.cos(t), np.zeros(samples)], axis=1)
    predicted = measured + 0.01 * np.sin(9.0 * t)[:, None]
    counted = np.abs(measured) > 0.02
    return Trace("/data/one.mcap", t, measured, predicted, counted)


@pytest.fixture(scope="session")
def run_report(run_content: dict[str, Any], trace: Trace) -> RunReport:
    speed = np.linspace(-1.0, 1.0, 9)
    model = 0.5 * np.sign(speed) + 0.1 * speed
    friction = FrictionCurve(0, speed, model + 0.01, model, np.full(9, 0.02))
    correlated = np.array([[1.0, -0.7], [-0.7, 1.0]])
    return RunReport(run_content, (trace,), (friction,), correlated)


@pytest.fixture(scope="session")
def validate_content(run_content: dict[str, Any]) -> dict[str, Any]:
    one = {
        name: e["held_out"] | {"raw_torque": e["raw_torque"]}
        for name, e in run_content["estimators"].items()
    }
    logs = [log | one["feasible"] | {"estimators": one} for log in run_content["logs"]]
    shared = ("arm", "estimator", "joints", "torque_units", "provenance", "seconds")
    return {key: run_content[key] for key in shared} | {
        "model": "identified/model.yaml",
        "fitted_on": ["/data/zero.mcap"],
        "logs": logs,
    }


@pytest.fixture(scope="session")
def gap_content(run_content: dict[str, Any]) -> dict[str, Any]:
    return {
        "arm": "bench",
        "joints": run_content["joints"],
        "verdict": "ambiguous",
        "effects": [
            {
                "name": "coupled_friction",
                "joints": [1, 2],
                "parameters": {"coulomb": {"value": 0.0412, "sd": 0.0031, "unit": "N m"}},
                "equation": "tau += J^T (Fm sgn(J qd))",
                "evidence": {
                    "gain_nats_per_sample": 0.373,
                    "asked_nats_per_sample": 0.214,
                    "standard_deviations": 12.4,
                    "leans_on": [
                        {
                            "name": "gravity_tilt",
                            "joints": [1],
                            "parameter": "coulomb_1",
                            "value_without": 0.052,
                            "unit": "N m",
                        }
                    ],
                    "taken_for_granted": "The torque constants are right.",
                    "held_out_parts": 3,
                    "confirmed_parts": 3,
                    "effect_free_runs": 4,
                    "next_best": "gravity_tilt at [1]",
                    "next_best_gain": 0.12,
                },
                "rivals": [{"name": "stribeck", "joints": [2], "evidence": 0.09}],
                "separating_experiment": "coupled_friction:1",
            }
        ],
        "where": [
            {"joint": 2, "region": "|qd| < 0.1 rad/s", "share_of_gap": 0.8},
            {"joint": 1, "region": "everywhere", "share_of_gap": 0.2},
        ],
        "not_observable": [{"name": "gravity_tilt", "joints": []}],
        "held_out": {
            "before": {"relative_error_percent": 3.21, "rms_by_joint": [0.3, 0.2, None]},
            "after": {"relative_error_percent": 1.23, "rms_by_joint": [0.1, 0.09, None]},
            "noise_floor": {"relative_error_percent": 1.11, "rms_by_joint": [0.08, 0.07, None]},
            "closed_fraction": 0.943,
        },
        "forward_simulation": {
            "before": {"rms_q_by_joint": [0.01, 0.02, None]},
            "after": {"rms_q_by_joint": [0.001, 0.003, None]},
        },
        "minimum_detectable": {"stribeck": {"1": 0.02, "2": 0.03}},
        "logs": [{"name": "gap/a.mcap", "samples": 1500, "remarks": ["3 samples were left out"]}],
        "seconds": 12.3,
        "provenance": run_content["provenance"],
    }


@pytest.fixture(scope="session")
def gap_report(gap_content: dict[str, Any]) -> GapReport:
    x = np.linspace(-1.0, 1.0, 12)
    panel = Panel("torque [N·m]", [Curve("the effect", WITH, x**3)])
    chart = line_chart("2 lift", ("speed [rad/s]", x), [panel], joint="2 lift")
    table = Table("Point by point.", ["joint", "x"], [["2 lift", "0.5"]])
    return GapReport(
        gap_content,
        {"stribeck": ("extra_friction", "N m")},
        [Figure("The effect as a curve", "Over speed.", [chart], table)],
        np.array([[0.5, 0.4, np.nan], [0.25, 0.15, np.nan]]),
    )


@pytest.fixture(scope="session")
def design_report(run_content: dict[str, Any]) -> DesignReport:
    rng = np.random.default_rng(1)
    names = tuple(run_content["joints"])
    a, b = rng.normal(size=(2, 3, 5)) * 0.1
    series = FourierSeries(names, 0.1 * np.pi, a, b, np.zeros(3))
    t = np.arange(0.0, series.period_s, 0.01)
    q, qd, _ = sample(series, t)
    two = np.full(3, 2.0)
    quantities = [
        Quantity("position", "rad", names, q, -two, two),
        Quantity("velocity", "rad/s", names, qd, -two, two),
        Quantity("torque", "N m", ("motor 1", "motor 2", "motor 3"), 0.5 * q, -two, two),
        Quantity(
            "distance",
            "m",
            ("base and hand",),
            0.2 + 0.1 * np.cos(t)[:, None],
            np.array([0.05]),
            np.array([np.inf]),
        ),
    ]
    trajectory = Trajectory(series, 3, {"condition_number": 56.78, "parameters": 57}, {})
    return DesignReport("bench", trajectory, quantities, t, {"seconds": {"search": 12.0}})
