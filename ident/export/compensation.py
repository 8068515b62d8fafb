"""Gravity and friction compensation as one C header, for controllers without Python."""

import re

import numpy as np
from numpy.typing import NDArray

from ident.export.links import held_joints, identified_links
from ident.model.identified_model import Model

_TEMPLATE = """\
/* Gravity and friction compensation of {arm}. Identified: {words}.
   C99 without allocation; joints in this order: {joints}. SI units and radians. */
#ifndef {guard}
#define {guard}

#include <math.h>

enum {{ {name}_joints = {n} }};

/* Torque that holds the arm at rest at q: gravity, and the torque offsets. */
static void {name}_static_torque(const double q[{n}], double tau[{n}])
{{
    static const int parent[{n}] = {{{parent}}};          /* -1: the base */
    static const int slides[{n}] = {{{slides}}};
    static const double place[{n}][12] = {{               /* rows of [R p] in the parent */
{place}
    }};
    static const double axis[{n}][3] = {{{axis}}};
    static const double moment[{n}][3] = {{               /* mass times centre of mass [kg m] */
{moment}
    }};
    static const double mass[{n}] = {{{mass}}};
    static const double gravity[3] = {{{gravity}}};
    static const double offset[{n}] = {{{offset}}};
    double r[{n}][9], p[{n}][3], a[{n}][3];
    int i, j, k, row;

    for (k = 0; k < {n}; ++k) {{
        const double *u = axis[k];
        const double c = slides[k] ? 1.0 : cos(q[k]), s = slides[k] ? 0.0 : sin(q[k]);
        const double d = slides[k] ? q[k] : 0.0, v = 1.0 - c;
        const double turn[9] = {{
            c + u[0] * u[0] * v, u[0] * u[1] * v - u[2] * s, u[0] * u[2] * v + u[1] * s,
            u[0] * u[1] * v + u[2] * s, c + u[1] * u[1] * v, u[1] * u[2] * v - u[0] * s,
            u[0] * u[2] * v - u[1] * s, u[1] * u[2] * v + u[0] * s, c + u[2] * u[2] * v}};
        double base[12];
        for (row = 0; row < 3; ++row)
            for (j = 0; j < 4; ++j) {{
                double x = place[k][4 * row + j];
                if (parent[k] >= 0) {{
                    const double *above = r[parent[k]];
                    x = j == 3 ? p[parent[k]][row] : 0.0;
                    for (i = 0; i < 3; ++i) x += above[3 * row + i] * place[k][4 * i + j];
                }}
                base[4 * row + j] = x;
            }}
        for (row = 0; row < 3; ++row) {{
            a[k][row] = p[k][row] = 0.0;
            for (j = 0; j < 3; ++j) {{
                r[k][3 * row + j] = 0.0;
                for (i = 0; i < 3; ++i) r[k][3 * row + j] += base[4 * row + i] * turn[3 * i + j];
                a[k][row] += base[4 * row + j] * u[j];
            }}
            p[k][row] = base[4 * row + 3] + d * a[k][row];
        }}
    }}
    for (j = 0; j < {n}; ++j) tau[j] = offset[j];
    for (k = 0; k < {n}; ++k) {{
        double held[3]; /* first moment about the base's origin */
        for (row = 0; row < 3; ++row) {{
            held[row] = mass[k] * p[k][row];
            for (i = 0; i < 3; ++i) held[row] += r[k][3 * row + i] * moment[k][i];
        }}
        for (j = k; j >= 0; j = parent[j]) {{
            double l[3];
            for (row = 0; row < 3; ++row) l[row] = held[row] - mass[k] * p[j][row];
            if (slides[j])
                for (row = 0; row < 3; ++row) tau[j] -= a[j][row] * mass[k] * gravity[row];
            else
                tau[j] -= a[j][0] * (l[1] * gravity[2] - l[2] * gravity[1])
                        + a[j][1] * (l[2] * gravity[0] - l[0] * gravity[2])
                        + a[j][2] * (l[0] * gravity[1] - l[1] * gravity[0]);
        }}
    }}
}}

/* Friction torque at the velocity qd. Coulomb friction rises from zero to its value at the speed
   `blend` [rad/s], so that a controller does not chatter at rest. */
static void {name}_friction_torque(const double qd[{n}], double blend, double tau[{n}])
{{
    enum {{ rows = {rows} }};
    static const double row[rows][{n}] = {{               /* speed that each friction acts on */
{row}
    }};
    static const double viscous[rows] = {{{viscous}}};
    static const double coulomb[rows] = {{{coulomb}}};
    int j, k;

    for (j = 0; j < {n}; ++j) tau[j] = 0.0;
    for (k = 0; k < rows; ++k) {{
        double speed = 0.0, sign;
        for (j = 0; j < {n}; ++j) speed += row[k][j] * qd[j];
        sign = speed > blend ? 1.0 : speed < -blend ? -1.0 : speed == 0.0 ? 0.0 : speed / blend;
        for (j = 0; j < {n}; ++j) tau[j] += row[k][j] * (viscous[k] * speed + coulomb[k] * sign);
    }}
}}

#endif
"""


def to_c(model: Model) -> str:
    """A C header with the torque that holds the arm, and the torque of its friction.

    Raises:
        DataError: parameters that no mass distribution can have.
    """
    links = identified_links(model)
    name = re.sub(r"\W", "_", model.arm)
    rows, viscous, coulomb = _friction(model)
    words = "; ".join([f"{model.estimator} model", *left_out_of_c(model)])
    return _TEMPLATE.format(
        arm=model.arm,
        words=words.replace("*/", "* /"),
        joints=", ".join(model.robot.joint_names),
        name=name,
        guard=f"{name.upper()}_COMPENSATION_H",
        n=len(links),
        parent=", ".join(str(-1 if x.parent is None else x.parent) for x in links),
        slides=", ".join(str(int(x.slides)) for x in links),
        place=_rows([x.placement[:3].ravel() for x in links]),
        axis=", ".join(f"{{{_list(x.axis)}}}" for x in links),
        moment=_rows([x.mass * x.center for x in links]),
        mass=_list([x.mass for x in links]),
        gravity=_list(model.robot.model.gravity.linear),
        offset=_list(model.parameter("fo")),
        rows=len(rows),
        row=_rows(rows),
        viscous=_list(viscous),
        coulomb=_list(coulomb),
    )


def left_out_of_c(model: Model) -> list[str]:
    """What the model holds and the header does not."""
    missing = [f"effect {effect.name}" for effect in model.effects.records]
    sentences = [f"left out: {', '.join(missing)}"] if missing else []
    return sentences + [s for s in (held_joints(model),) if s]


def _friction(model: Model) -> tuple[list[NDArray], list[float], list[float]]:
    """Speeds on which friction acts, one row each, with their viscous and Coulomb friction."""
    rows = list(np.eye(model.robot.dof))
    viscous, coulomb = list(model.parameter("fv")), list(model.parameter("fc"))
    for motor in model.terms.coupled_motors if model.terms.motor_friction else ():
        rows.append(model.terms.drive_matrix[motor - 1])
        viscous.append(model.parameter("fvm")[motor - 1])
        coulomb.append(model.parameter("fcm")[motor - 1])
    return rows, viscous, coulomb


def _list(values: NDArray | list[float]) -> str:
    return ", ".join(repr(float(x)) for x in values)


def _rows(rows: list[NDArray]) -> str:
    return ",\n".join(f"        {{{_list(row)}}}" for row in rows)
