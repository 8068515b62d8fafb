"""Effects that are there only for another one's sake are taken back."""

import numpy as np
import pytest
from servo_arm import JOINTS, URDF, recording

import ident
from ident.output_error.fit import fit
from ident.output_error.judging import left_out
from ident.output_error.parameters import ROW
from ident.output_error.prepared import prepared, searched
from ident.output_error.recordings import segments_of
from ident.output_error.search.fewest import fewest
from ident.output_error.search.late_start import begun_with_delay
from ident.output_error.search.parts import OFFSET
from ident.output_error.search.selection import Accepted, Selection
from ident.output_error.search.settings import SearchSettings

SETTINGS = SearchSettings()


@pytest.mark.parametrize("torque", [[0.4, 0.0], [0.4, 0.4]], ids=["one", "both"])
def test_what_is_not_needed_beside_the_others_is_taken_back(torque: list[float]) -> None:
    made = recording(16.0, hidden=lambda q, _: -np.array(torque) + 0.0 * q)
    arm = ident.Arm.from_urdf(URDF).of_recording(JOINTS)
    begun = prepared(arm, segments_of(made, JOINTS, "log"))
    begun, base = begun_with_delay(begun, searched(begun.setup), SETTINGS)
    effects = [Accepted(OFFSET, j, 1.0, 0.03, 0.0, None, ()) for j in range(2)]
    free = base.fit.free.copy()
    free[ROW["offset"]] = True
    both = fit(base.setup, base.fit.settings, free, begun.prior)
    errors = left_out(base.setup, both, begun.prior)
    found = Selection(base.setup, both, errors, tuple(effects))
    kept = fewest(found, base.fit, effects, begun, SETTINGS)
    assert [a.joint for a in kept.accepted] == np.flatnonzero(torque).tolist()
    assert kept.fit.settings[ROW["offset"]] == pytest.approx(torque, abs=0.02)
