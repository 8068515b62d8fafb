"""Base parameters against Table I of the paper, and against the rank of random arms."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ident.dynamics.base_parameters import (
    Posture,
    base_map,
    combination_name,
    independent_columns,
    whole_range,
)
from ident.dynamics.parameters import Parameter, Terms, standard_parameters, unit_rows
from ident.dynamics.regressor import SHARP, Motion, sharp_columns, smooth_columns
from ident.estimation.problem import prior_parameters
from wamctl.arm.robot import cad_parameters, inverse_dynamics, load_robot

TABLE_1 = """
L1yy + L2zz = 0.132848
fv1
fc1
L2xx - L2zz + L3zz - 1.1 l3y + 0.300475 (m3 +m4 +m5 +m6 +m7) = 1.180983
L2xy = 0.000013
L2xz = 0.000117
L2yy + L3zz - 1.1 l3y + 0.300475 (m3 +m4 +m5 +m6 +m7) = 1.188985
L2yz = -0.000037
l2x = -0.009183
l2z - l3y + 0.55 (m3 +m4 +m5 +m6 +m7) = 2.332826
fv2
fc2
L3xx - L3zz + 0.002025m3 + L4zz = 0.003856
L3xy - 0.045 l3y = -0.000025
L3xz = -0.000005
L3yy - 0.002025m3 + L4zz - 0.00405 (m4 +m5 +m6 +m7) = -0.006954
L3yz = 0.000005
l3x + 0.045 (m3 +m4 +m5 +m6 +m7) = 0.147625
l3z + l4y = -0.000491
fv3
fc3
L4xx - L4zz + 0.002025m4 + L5zz - 0.6 l5y + 0.092025 (m5 +m6 +m7) = 0.114905
L4xy + 0.045 l4y = -0.000039
L4xz = -0.000082
L4yy - 0.002025m4 + L5zz - 0.6 l5y + 0.087975 (m5 +m6 +m7) = 0.105689
L4yz = 0.000094
l4x - 0.045 (m4 +m5 +m6 +m7) = -0.123510
l4z - l5y + 0.3 (m5 +m6 +m7) = 0.501024
fv4
fc4
L5xx - L5zz + L6zz = 0.000565
L5xy = -0.000000
L5xz = 0.000000
L5yy + L6zz = 0.000653
L5yz = 0.000001
l5x = 0.000011
l5z + l6y = -0.006580
fv5
fc5
L6xx - L6zz + L7yy + 0.12 l7z + 0.0036m7 = 0.000615
L6xy = -0.000001
L6xz = 0.000002
L6yy + L7yy + 0.12 l7z + 0.0036m7 = 0.000758
L6yz = 0.000222
l6x = -0.000051
l6z + l7z + 0.06m7 = 0.014214
fv6
fc6
L7xx - L7yy = -0.000000
L7xy = 0.000000
L7xz = -0.000000
L7yz = 0.000000
L7zz = 0.000074
l7x = -0.000005
l7y = 0.000011
fv7
fc7
"""
"""Parameter combination and CAD value, as printed; friction has none."""


def terms(dof, offset=False, rotor_inertia=False, drive_matrix=None, motor_friction=False):
    matrix = np.eye(dof) if drive_matrix is None else drive_matrix
    return Terms(True, True, offset, rotor_inertia, matrix, motor_friction)


def test_table_1_comes_out_to_every_printed_digit(wam):
    printed = [line.partition(" = ") for line in TABLE_1.strip().splitlines()]
    base = base_map(wam.arm.robot, wam.arm.terms, [whole_range(7)])
    cad = base.K @ prior_parameters(wam.arm.robot, base)
    assert base.names == tuple(name for name, _, _ in printed)
    for (name, _, value), found in zip(printed, cad, strict=True):
        if value:
            assert f"{found:.6f}" == value, name


def test_offset_and_rotor_inertia_make_69_of_98(wam):
    base = base_map(wam.arm.robot, terms(7, True, True), [whole_range(7)])
    assert len(base.parameters) == 98
    assert len(base.kept) == 69
    alone = [n for n in base.names if n.startswith("ia")]
    assert alone == ["ia3", "ia4", "ia5", "ia6", "ia7"]  # the first two regroup


def test_columns_that_are_only_rounding_do_not_count(wam):
    """Normalised first, columns of rounding errors look independent: 61 instead of 57."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(50, 3))
    rounding = 1e-15 * rng.normal(size=(50, 2))
    kept, _ = independent_columns(np.column_stack([rows, rounding, rows @ [1.0, 2.0, 3.0]]))
    assert kept == [0, 1, 2]


def test_a_column_that_a_rounded_angle_sets_apart_does_not_count():
    """A base that hangs by 3.1416 tells one more column from the others, by millionths."""
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(50, 3))
    nearly = rows @ [1.0, 2.0, 3.0] + 1e-5 * rng.normal(size=50)
    kept, _ = independent_columns(np.column_stack([rows, nearly]))
    assert kept == [0, 1, 2]


@pytest.mark.parametrize("rounding", [2.7e-6, 8.0e-4, 0.0])
def test_rounded_angles_of_a_urdf_make_no_parameters(wam, rounding):
    """A base turned by 3.14159, or by 1.57, lets gravity pull at joint 1 beside its axis."""
    model = pin.Model(wam.arm.robot.model)
    model.gravity.linear = 9.81 * np.array([0.0, np.sin(rounding), np.cos(rounding)])
    base = base_map(replace(wam.arm.robot, model=model), terms(7), [whole_range(7)])
    assert len(base.kept) == 57
    assert not {"l1x", "l1y"} & set(base.names)


def test_held_joints_leave_the_planar_arm_that_moves(wam):
    """A WAM that moves its joints 2 and 4 only is a pendulum of two links in a plane."""
    moving = np.array([0, 1, 0, 1, 0, 0, 0], dtype=bool)
    base = base_map(wam.arm.robot, wam.arm.terms, [Posture(np.zeros(7), np.pi * moving)])
    assert len(base.kept) == 10  # 2 x (inertia, two first moments), and friction
    assert [n for n in base.names if n.startswith("f")] == ["fv2", "fc2", "fv4", "fc4"]


def test_a_coupled_wrist_keeps_motor_friction_beside_joint_friction(wam):
    matrix = np.eye(7)
    matrix[5, 4] = 1.0  # motor 6 turns with joints 5 and 6
    base = base_map(
        wam.arm.robot, terms(7, drive_matrix=matrix, motor_friction=True), [whole_range(7)]
    )
    assert {"fv5", "fc5", "fv6", "fc6", "fvm6", "fcm6"} <= set(base.names)


def test_rows_of_the_drive_matrix_are_scaled_to_the_joint_that_turns_most():
    rows = unit_rows(np.array([[0.0, 28.25, -16.8155], [-42.0, 0.0, 0.0], [3.0, 0.0, 6.0]]))
    np.testing.assert_allclose(rows, [[0, 1, -16.8155 / 28.25], [1, 0, 0], [0.5, 0, 1]])


@pytest.mark.parametrize(
    ("coefficients", "name"),
    [
        ({"L1yy": 1, "L2zz": 1}, "L1yy + L2zz"),
        ({"l2z": 1, "m1": 0.06}, "0.06m1 + l2z"),
        ({"l2z": 1, "m1": 3.7e-6}, "l2z"),
        ({"l1z": 1, "m1": -1, "m2": -1}, "l1z - (m1 +m2)"),
        ({"L1xx": 1, "m1": 0.002025, "L2zz": 1, "l2y": -0.6}, "L1xx + 0.002025m1 - 0.6 l2y + L2zz"),
    ],
)
def test_names_of_combinations(wam, coefficients, name):
    parameters = [p for p in standard_parameters(wam.arm.robot, wam.arm.terms) if p.index <= 2]
    order = [p.name for p in parameters]
    row = np.array([coefficients.get(n, 0.0) for n in order])
    found = combination_name(row, parameters)
    assert sorted(found.replace("- ", "-").split()) == sorted(name.replace("- ", "-").split())


ORIGIN = (0, 0, 0)
LIMIT = '<limit lower="-3" upper="3" velocity="9" effort="9"/>'


def trees():
    """Random trees of fixed, sliding, turning and endless joints, placed and turned at will."""
    number = st.integers(-10, 10).map(lambda k: k / 10)
    xyz = st.tuples(number, number, number)
    axis = st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0, -0.6, 0.8)])
    kind = st.sampled_from(["revolute", "revolute", "continuous", "prismatic", "fixed"])
    joint = st.tuples(kind, xyz, xyz, axis, st.integers(0, 9), xyz, xyz)
    moving = st.lists(joint, min_size=1, max_size=6).filter(
        lambda js: any(j[0] != "fixed" for j in js)
    )
    return moving.map(lambda joints: load_robot(tree(joints)))


def tree(joints):
    """A URDF: each joint hangs at an earlier link, and bears a link with mass."""
    parts = ['<link name="link0"/>']
    for k, (kind, xyz, rpy, axis, parent, com, turned) in enumerate(joints, 1):
        origin, centre = (place(*frame) for frame in ((xyz, rpy), (com, turned)))
        parts.append(
            f'<link name="link{k}"><inertial>{centre}<mass value="{k}"/><inertia ixx="0.02"'
            ' iyy="0.03" izz="0.015" ixy="0.001" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{k}" type="{kind}"><parent link="link{parent % k}"/>'
            f'<child link="link{k}"/>{origin}<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>'
            f"{LIMIT if kind in ('revolute', 'prismatic') else ''}</joint>"
        )
    return f'<robot name="tree">{"".join(parts)}</robot>'


def place(xyz, rpy):
    return '<origin xyz="{} {} {}" rpy="{} {} {}"/>'.format(*xyz, *rpy)


@given(robot=trees(), seed=st.integers(0, 99))
@settings(max_examples=60, deadline=None)
def test_regressor_and_base_map_of_random_arms(robot, seed):
    """H delta is the inverse dynamics plus friction; K keeps all of it; the rank is right."""
    rng = np.random.default_rng(seed)
    of = terms(robot.dof, offset=True, rotor_inertia=True)
    base = base_map(robot, of, [whole_range(robot.dof)])
    q, qd, qdd = rng.uniform(-1.5, 1.5, (3, 60, robot.dof))
    friction = {k: rng.uniform(0.1, 1.0, robot.dof) for k in ("fv", "fc", "fo", "ia")}
    links = dict(zip(robot.inertial_names, cad_parameters(robot), strict=True))
    delta = np.array(
        [
            links[p.name] if p.kind == "inertial" else friction[p.kind][p.index - 1]
            for p in base.parameters
        ]
    )
    columns = all_columns(robot, of, base.parameters, Motion(q, qd, qdd))
    sizes = np.linalg.norm(columns.reshape(-1, len(delta)), axis=0)
    sizes /= sizes.max()
    assume(not ((sizes > 1e-9) & (sizes < 3e-3)).any())  # they pass for an angle's rounding
    torque = inverse_dynamics(robot, q, qd, qdd) + friction["ia"] * qdd
    torque += friction["fv"] * qd + friction["fc"] * np.sign(qd) + friction["fo"]
    np.testing.assert_allclose(columns @ delta, torque, atol=1e-9)
    np.testing.assert_allclose(columns[..., base.kept] @ (base.K @ delta), torque, atol=1e-7)
    rows = columns.reshape(-1, len(delta))
    lengths = np.linalg.norm(rows, axis=0)
    scaled = rows[:, lengths > 1e-9 * lengths.max()] / lengths[lengths > 1e-9 * lengths.max()]
    singular = np.linalg.svd(scaled, compute_uv=False)
    assert np.sum(singular > 1e-8 * singular[0]) == len(base.kept)


def all_columns(robot, of, parameters, motion):
    smooth = [i for i, p in enumerate(parameters) if p.kind not in SHARP]
    sharp = [i for i, p in enumerate(parameters) if p.kind in SHARP]
    columns = np.empty((*motion.q.shape, len(parameters)))
    columns[..., smooth] = smooth_columns(robot, of, motion, [parameters[i] for i in smooth])
    columns[..., sharp] = sharp_columns(of, motion.qd, [parameters[i] for i in sharp])
    return columns


def test_a_sharp_parameter_has_no_smooth_column(wam):
    zero = Motion(*np.zeros((3, 1, 7)))
    with pytest.raises(ValueError, match="fc1 has no smooth column"):
        smooth_columns(wam.arm.robot, wam.arm.terms, zero, [Parameter("fc1", "N m", "fc", 1)])


def test_units_of_a_sliding_joint():
    robot = load_robot(tree([("prismatic", ORIGIN, ORIGIN, (0, 0, 1), 0, ORIGIN, ORIGIN)]))
    units = {p.name: p.unit for p in standard_parameters(robot, replace(terms(1), offset=True))}
    assert (units["fv1"], units["fc1"], units["fo1"]) == ("N s/m", "N", "N")
