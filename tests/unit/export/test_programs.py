"""Generated programs against the model: a C header through a compiler, and a Python module."""

import ctypes
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "ident"))

from test_export import crane, identified, mujoco_torque, relative, states, wam, with_zero
from test_model_with_effects import EFFECTS, motion, plain, run_of

from ident.effects.bound_effects import bound
from ident.export.mjcf import left_out_of_mjcf, to_mjcf
from ident.export.programs import left_out_of_c, to_c, to_python
from ident.export.replay import replay, rms_of
from ident.export.urdf import to_urdf
from ident.model.identified_model import Model
from wamctl.arm.config import shipped_file
from wamctl.arm.errors import DataError

compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")
PARTLY = {"presliding"}  # as Coulomb friction
WITHOUT = {"thermal_drift", "torque_delay", "joint_elasticity", "backlash"}


def compiled(model: Model, name: str, folder: Path) -> ctypes.CDLL:
    """The header's functions as a library."""
    folder.mkdir(exist_ok=True)
    (folder / "arm.h").write_text(to_c(model))
    (folder / "arm.c").write_text(
        '#include "arm.h"\n'
        f"void hold(const double *q, double *tau) {{ {name}_static_torque(q, tau); }}\n"
        "void rub(const double *qd, double blend, double *tau)"
        f" {{ {name}_friction_torque(qd, blend, tau); }}\n"
        "void move(const double *q, const double *qd, const double *qdd, double *tau)"
        f" {{ {name}_inverse_dynamics(q, qd, qdd, 0.0, tau); }}\n"
    )
    command = "cc -std=c99 -O1 -Wall -Wextra -Werror -pedantic -shared -fPIC arm.c -lm -o arm.so"
    subprocess.run(command.split(), cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "arm.so"))
    vector = np.ctypeslib.ndpointer(dtype=np.float64, shape=(model.robot.dof,))
    library.hold.argtypes = [vector, vector]
    library.rub.argtypes = [vector, ctypes.c_double, vector]
    library.move.argtypes = [vector] * 4
    return library


def python_of(model: Model) -> dict:
    """The names that the generated module defines."""
    names: dict = {}
    exec(compile(to_python(model), "arm.py", "exec"), names)
    return names


@compiler
@pytest.mark.parametrize("arm", ["wam", "crane"])
def test_c_gives_the_same_torque(arm: str, tmp_path: Path) -> None:
    model = replace(identified(*wam()), arm="my arm") if arm == "wam" else crane()
    library = compiled(model, "my_arm" if arm == "wam" else "crane", tmp_path)
    q, qd, qdd = states(model)
    held, rubbed, moved = np.empty_like(q), np.empty_like(q), np.empty_like(q)
    for k in range(len(q)):
        library.hold(q[k], held[k])
        library.rub(qd[k], 0.0, rubbed[k])
        library.move(q[k], qd[k], qdd[k], moved[k])
    zero = np.zeros_like(q)
    assert relative(held, model.gravity(q)) < 1e-9
    friction = with_zero(model, "fv", "fc", "fvm", "fcm", keep=True)
    assert relative(rubbed, friction.inverse_dynamics(zero, qd, zero)) < 1e-9
    assert relative(moved, model.inverse_dynamics(q, qd, qdd)) < 1e-9
    slow, torque = np.full(model.robot.dof, 0.01), np.empty(model.robot.dof)
    library.rub(slow, 1e9, torque)
    viscous = with_zero(model, "fv", "fvm", keep=True).inverse_dynamics(zero[0], slow, zero[0])
    np.testing.assert_allclose(torque, viscous, rtol=1e-6)


@pytest.mark.parametrize("arm", ["wam", "crane"])
def test_python_gives_the_same_torque(arm: str) -> None:
    model = identified(*wam()) if arm == "wam" else crane()
    inverse_dynamics = python_of(model)["inverse_dynamics"]
    q, qd, qdd = (x[:50] for x in states(model))
    found = np.array([inverse_dynamics(*row, blend=0.0) for row in zip(q, qd, qdd, strict=True)])
    assert relative(found, model.inverse_dynamics(q, qd, qdd)) < 1e-9


@compiler
@pytest.mark.parametrize("item", EFFECTS, ids=lambda e: e.name)
def test_effects_are_in_both_programs_or_said_to_be_left_out(item, tmp_path: Path) -> None:
    """First-order effects (a tilt, an encoder's offset) are exact in the programs."""
    model = replace(plain(), effects=bound((item,)))
    sentences = left_out_of_c(model)
    assert bool(sentences) == (item.name in WITHOUT | PARTLY)
    assert all(f"effect {item.name} of " in s and " N m rms)" in s for s in sentences)
    q, qd, qdd = (x[::100] for x in (motion().q, motion().qd, motion().qdd))
    expected = model.inverse_dynamics(q, qd, qdd)
    if item.name in WITHOUT:
        expected = plain().inverse_dynamics(q, qd, qdd)
    library, inverse_dynamics = compiled(model, "wam7", tmp_path), python_of(model)
    moved = np.empty_like(q)
    for k in range(len(q)):
        library.move(q[k], qd[k], qdd[k], moved[k])
        told = inverse_dynamics["inverse_dynamics"](q[k], qd[k], qdd[k], blend=0.0)
        np.testing.assert_allclose(told, moved[k], atol=1e-9)
    first_order = item.name in ("gravity_tilt", "encoder_offset")
    assert relative(moved, expected) < (3e-3 if first_order else 1e-9)


IN_MJCF = {
    *("torque_offset", "coupled_friction", "rotor_inertia", "payload", "gravity_tilt"),
    *("encoder_offset", "joint_spring", "torque_gain", "coupled_inertia"),
    *("stribeck", "nonlinear_viscous", "asymmetric_viscous", "torque_delay"),
}
IN_PIECES = {"stribeck", "nonlinear_viscous"}  # straight ones, and friction: see test_mjcf_effects
AT_ONE_SAMPLE = IN_MJCF - IN_PIECES - {"torque_delay"}


@pytest.mark.parametrize("item", EFFECTS, ids=lambda e: e.name)
def test_effects_are_in_mjcf_or_said_to_be_left_out(item) -> None:
    if item.name == "coupled_friction":  # MuJoCo smooths it: the drag alone is compared
        item = item.model_copy(update={"parameters": {"viscous_1": 0.5, "coulomb_1": 0.0}})
    if item.name == "coupled_inertia":  # alone, it could not be
        both = {"coupling": 0.2, "own_a": 0.3, "own_b": 0.3}
        item = item.model_copy(update={"parameters": both, "variant": "coupling and own"})
    model = with_zero(replace(plain(), effects=bound((item,))), "fc")
    assert bool(left_out_of_mjcf(model)) == (item.name not in IN_MJCF)
    if item.name in AT_ONE_SAMPLE:
        q, qd, qdd = (x[::100] for x in (motion().q, motion().qd, motion().qdd))
        torque = mujoco_torque(to_mjcf(model), q, qd, qdd)
        first_order = item.name in ("gravity_tilt", "encoder_offset")
        expected = model.inverse_dynamics(q, qd, qdd)
        assert relative(torque, expected) < (3e-3 if first_order else 1e-9)


def test_names_of_foreign_files_stay_in_the_comments_of_xml() -> None:
    model = replace(plain(), arm="a --> <evil/> <!-- b--")
    for write in (to_mjcf, to_urdf):
        root = ElementTree.fromstring(write(model))
        assert [e.tag for e in root.iter() if e.tag == "evil"] == []


@compiler
def test_foreign_names_stay_in_comments(tmp_path: Path) -> None:
    """A name out of a foreign file neither ends the comment nor becomes a program."""
    name = 'x */ int main(void){return 7;} /* \\\n ??/ @n@ """ + print("x")'
    model = replace(plain(), arm=name)
    text = to_c(model)
    assert "*/ int main" not in text
    assert "\nint main" not in text
    assert text.count("/*") == text.count("*/") == to_c(plain()).count("*/")
    python_of(model)
    (identifier,) = re.findall(r"^enum \{ (\w+)_joints = 7", text, flags=re.MULTILINE)
    compiled(model, identifier, tmp_path)


def test_the_exported_arm_follows_a_recording_in_mujoco_as_the_own_simulation_does() -> None:
    """An arm with an offset and a spring; one without the two goes elsewhere."""
    model = replace(plain(), effects=bound((EFFECTS[0], EFFECTS[13])))
    config = shipped_file("wam7.yaml").read_bytes()
    recording = replace(run_of(model), attachments={"config.yaml": config})
    found = rms_of([replay(to_mjcf(model), model, recording, "log")])
    bare = rms_of([replay(to_mjcf(plain()), model, recording, "log")])
    assert max(found["own"]) < 1e-4  # the encoders' steps
    assert (np.array(found["mujoco"]) < 1.2 * np.array(found["own"])).all()
    assert bare["mujoco"][3] > 50 * found["mujoco"][3]


def test_a_recording_that_cannot_be_replayed_is_told() -> None:
    with pytest.raises(DataError, match="log cannot be replayed: it holds no controller"):
        replay(to_mjcf(plain()), plain(), run_of(plain()), "log")
