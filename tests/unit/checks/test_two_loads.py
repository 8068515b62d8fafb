"""Two recordings of an arm that carried something in one of them only."""

import numpy as np
from chain_arm import Experiment, urdf_of

from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.workflows.gap import gap_of


def test_an_offset_at_one_joint_does_not_answer_for_what_all_others_lack() -> None:
    """Without an effect, what lies far above the repeats' noise was told; with one, no more."""
    heavy = urdf_of(4, 5.0 * 0.7 ** np.arange(4) + np.array([0.0, 0.0, 0.0, 1.0]))
    plain = Experiment(joints=4, seconds=30.0, seed=3).log()
    loaded = Experiment(joints=4, seconds=30.0, seed=3, true_urdf=heavy).log()
    logs = [log.with_(tau=log.tau + np.array([6.0, 0.0, 0.0, 0.0])) for log in (plain, loaded)]
    source = of_arm(plain.arm(), None, [log.recording() for log in logs], ["plain", "loaded"])
    found = gap_of(source, Options(null_runs=0), lambda *told: None).content
    left = found["held_out"]["after"], found["held_out"]["noise_floor"]
    after, floor = (x["relative_error_percent"] for x in left)
    assert after > 3.0 * floor
    assert found["verdict"] == "unknown"
    assert {u["joint"] for u in found["unexplained"]} & {2, 3, 4}


def searched(*logs):
    arm, names = logs[0].arm(), [f"log_{i}" for i in range(len(logs))]
    source = of_arm(arm, None, [log.recording() for log in logs], names)
    return gap_of(source, Options(null_runs=0), lambda *told: None).content


def test_a_search_tells_recordings_that_contradict_each_other() -> None:
    """As `ident run` does: effects answer for none of it, and the search was trusted."""
    heavy = urdf_of(4, 5.0 * 0.7 ** np.arange(4) + np.array([0.0, 0.0, 0.0, 1.0]))
    first, second = (Experiment(joints=4, seconds=30.0, seed=s).log() for s in (3, 4))
    loaded = Experiment(joints=4, seconds=30.0, seed=4, true_urdf=heavy).log()
    right, wrong = searched(first, second), searched(first, loaded)
    assert right["trust"] == "trustworthy"
    assert "recordings_disagree" not in right
    (told,) = (r for r in wrong["remarks"] if r["code"] == "recordings_disagree")
    assert "A different load on the last link alone would explain it" in told["sentence"]
    assert wrong["trust"] == "doubtful"
    assert wrong["recordings_disagree"][0]["change"] == "load"
