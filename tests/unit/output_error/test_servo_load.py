"""A servo whose gears lose a part of what passes them: a pendulum on a test bench.

The pendulum is integrated here, in steps of 50 us, by nothing of the tool's own.
"""

import numpy as np
import pytest

import ident

MASS, LEVER, ROTOR, INERTIA = 0.5, 0.1, 1.5e-3, 2e-4
GAIN, DAMPING, COULOMB, LOSS = 0.9, 0.03, 0.005, 0.4
STEP_S, SAMPLE_S = 5e-5, 0.01
STEP_RAD = 2 * np.pi / 4096

URDF = f"""<robot name="pendulum"><link name="base"/>
  <link name="arm"><inertial><origin xyz="0 0 {-LEVER}"/><mass value="{MASS}"/>
    <inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="servo" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-3.2" upper="3.2" effort="2" velocity="12"/></joint></robot>"""


def recording(hz: tuple[float, ...], size: tuple[float, ...]) -> ident.Recording:
    """Six seconds; the side that drives loses its part: the motor, or the weight it lets down."""
    t = np.arange(0.0, 6.0, SAMPLE_S)
    wanted = sum(a * np.sin(2 * np.pi * f * t) for f, a in zip(hz, size, strict=True))
    q, v, told = 0.0, 0.0, np.empty_like(t)
    inertia = ROTOR + INERTIA + MASS * LEVER**2
    for k, command in enumerate(wanted):
        told[k] = np.round(q / STEP_RAD) * STEP_RAD
        for _ in range(round(SAMPLE_S / STEP_S)):
            motor, weight = GAIN * (command - q), MASS * 9.81 * LEVER * np.sin(q)
            level = COULOMB + LOSS * max(abs(motor), abs(weight))
            free = v + STEP_S * (motor - weight - DAMPING * v) / inertia
            v = np.sign(free) * max(abs(free) - STEP_S * level / inertia, 0.0)
            q += STEP_S * v
    return ident.Recording(t, told[:, None], joints=("servo",), q_command=wanted[:, None])


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[ident.Arm, list[ident.Recording]]:
    urdf = tmp_path_factory.mktemp("bench") / "pendulum.urdf"
    urdf.write_text(URDF, encoding="utf-8")
    motions = [((0.5, 1.3), (1.0, 0.4)), ((0.3, 0.9), (1.2, 0.5)), ((0.7, 2.0), (0.8, 0.2))]
    return ident.Arm.from_urdf(urdf), [recording(*m) for m in motions]


def test_gears_lose_a_part_of_what_passes_them(bench) -> None:
    found = ident.identify(*bench, method="simulation")
    assert found.model.value("load_friction") == pytest.approx(LOSS, abs=0.04)
    assert found.model.value("armature") == pytest.approx(ROTOR, rel=0.3)
    assert found.model.value("coulomb") < 0.03
    assert not found.remarks  # such as commands that come too late, for which it passed
    assert found.content["held_out"]["rms_q_by_joint"][0] < 0.01


def test_a_zero_that_is_a_right_angle_off_is_told(bench, tmp_path) -> None:
    turned = tmp_path / "turned.urdf"
    text = URDF.replace(f"0 0 {-LEVER}", f"{LEVER} 0 0")
    turned.write_text(text, encoding="utf-8")
    found = ident.identify(ident.Arm.from_urdf(turned), bench[1], method="simulation")
    (told,) = (r for r in found.content["remarks"] if r["code"] == "zero_pose")
    assert "+90 degrees" in told["sentence"]
    urdf = {"urdf": "turned.urdf", "joints": ["servo"]}
    servo = {"fixed": {"zero": np.pi / 2}, "first": {"load_friction": 0.1}}
    config = tmp_path / "turned.yaml"
    config.write_text(f"arm: turned\nrobot: {urdf}\nservo: {servo}\n", encoding="utf-8")
    mended = ident.identify(ident.Arm.from_config(config), bench[1], method="simulation")
    assert not mended.remarks
    assert mended.model.value("load_friction") == pytest.approx(LOSS, abs=0.04)
    assert "load_friction" in {p["name"] for p in mended.content["parameters"]}


def test_their_loss_is_named(bench) -> None:
    found = ident.find_gap(*bench, method="simulation")
    (effect,) = found.effects
    assert effect.name == "load_dependent_friction"
    assert found.verdict in ("named", "ambiguous")
