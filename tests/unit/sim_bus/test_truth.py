import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bus.assembly import load_simulation
from sim_bus.plant.truth import disturbed, write_truth
from wamctl.arm.inertial import pseudo_inertia

LINK = np.array([0.3, 0.01, 0.0, 0.1, 0.0, 0.26, -0.1, 1.4, -0.03, 11.4])


@given(st.integers(0, 10**6), st.floats(0.0, 0.5))
@settings(max_examples=100, deadline=None)
def test_a_disturbed_link_is_physically_possible(seed, spread):
    link = disturbed(LINK, spread, np.random.default_rng(seed))
    assert np.linalg.eigvalsh(pseudo_inertia(link)).min() > 0.0


def test_the_spread_is_that_of_the_mass():
    random = np.random.default_rng(3)
    masses = [disturbed(LINK, 0.1, random)[9] / LINK[9] for _ in range(2000)]
    assert np.std(masses) == pytest.approx(0.1, rel=0.1)


def test_no_spread_is_the_cad_model():
    np.testing.assert_allclose(disturbed(LINK, 0.0, np.random.default_rng(0)), LINK, atol=1e-12)


def test_the_truth_is_written_and_depends_on_the_seed_alone(tmp_path):
    files = [tmp_path / name for name in ("a", "b", "c")]
    for path, seed in zip(files, (5, 5, 6), strict=True):
        write_truth(path, load_simulation("wam7.yaml", seed).truth)
    texts = [path.read_text() for path in files]
    assert texts[0] == texts[1] != texts[2]
    content = yaml.safe_load(texts[0])
    assert list(content["inertial"])[:3] == ["L1xx", "L1xy", "L1xz"]
    assert len(content["inertial"]) == 70
    assert len(content["coulomb_nm"]) == 7
