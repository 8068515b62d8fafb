"""An effect that another package brings by an entry point, found without an installation."""

import sys
from pathlib import Path

import numpy as np
import pytest
from closed_loop import recorded, source_of, wam

from ident.effects.catalogue import catalogue
from ident.gap.options import Options
from ident.gap.search import search
from wamctl.arm.errors import DataError

EXAMPLE = Path(__file__).parents[3] / "scripts" / "examples" / "eddy_brake"


def installed(folder: Path, name: str, value: str) -> Path:
    """A folder with the metadata that an installed package would have."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[ident.effects]\n{name} = {value}\n")
    return folder


@pytest.fixture
def brought(monkeypatch, tmp_path):
    """Put the metadata of a package on the path, and forget it afterwards."""

    def bring(name: str, value: str) -> None:
        monkeypatch.syspath_prepend(str(EXAMPLE))
        monkeypatch.syspath_prepend(str(installed(tmp_path, name, value)))
        catalogue.cache_clear()

    yield bring
    catalogue.cache_clear()
    sys.modules.pop("ident_eddy_brake", None)


def test_the_example_is_found_named_and_measured(brought):
    brought("eddy_brake", "ident_eddy_brake:EFFECT")
    effect = catalogue()["eddy_brake"]
    brake = effect.at((3,), effect.Parameters(0.3))
    found = search(
        source_of(recorded(effect.simulated(wam(), brake, np.array([2.0])), moving=(1, 3))),
        Options(null_runs=1),
        lambda _: None,
    ).verdict.effects
    assert [(f.candidate.effect, f.candidate.joints) for f in found] == [("eddy_brake", (3,))]
    assert found[0].score.values[0] == pytest.approx(2.0, rel=0.05)
    assert found[0].candidate.parameters.speed == pytest.approx(0.3, rel=0.1)


def test_a_package_that_cannot_be_loaded_is_named(brought):
    brought("eddy_brake", "ident_eddy_brake:NOTHING")
    with pytest.raises(DataError, match="'eddy_brake' cannot be loaded from ident_eddy_brake:NOT"):
        catalogue()


def test_an_object_that_is_no_effect_is_refused(brought):
    brought("eddy_brake", "ident_eddy_brake:Brake")
    with pytest.raises(DataError, match=r"is a type: it must be an object of .*Effect"):
        catalogue()


def test_an_id_that_is_taken_is_refused(brought):
    brought("other", "ident.effects.stribeck:EFFECT")
    with pytest.raises(DataError, match=r"'stribeck' of ident\.effects\.stribeck:EFFECT has an id"):
        catalogue()
