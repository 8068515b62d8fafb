"""The search: scores against brute force, silence without an effect, and honest answers."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import cord, nominal_of, recorded, source_of, wam

from ident.checks.examine import examine
from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import SEARCHED
from ident.gap.data.broken_time import data_faults
from ident.gap.data.experiment import experiment, facts_of
from ident.gap.data.noise_regions import Region
from ident.gap.lack_of_fit.repeatability import repeated_rows
from ident.gap.options import Options
from ident.gap.regression.design_matrix import build_design_matrix
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.regression.model_columns import joint_columns
from ident.gap.results.error_by_term import error_by_term
from ident.gap.results.held_out_error import before_and_after, gap_location, held_out
from ident.gap.results.verdict import Kind
from ident.gap.search import search
from ident.gap.settings import Repeats
from ident.simulation.arm import Term


def brute_force(design, choice, sigma, rounds=40):
    """Stacked least squares of all joints, weights by joint and region, until they settle."""
    chosen = joint_columns(design.equations, choice)
    size = 1 + max(int(p.unknown.max()) for p in chosen)
    rows = np.isin(design.fold, SEARCHED)
    for _ in range(rounds):
        blocks, rights = [], []
        for j, p in enumerate(chosen):
            weight = 1 / sigma[j][design.region[rows, j]]
            block = np.zeros((rows.sum(), size))
            block[:, p.unknown] = design.columns[j][rows][:, p.local] @ p.mix * weight[:, None]
            blocks.append(block)
            rights.append(design.columns[j][rows, -1] * weight)
        W = np.concatenate(blocks)
        scale = np.linalg.norm(W, axis=0)
        scale[scale == 0.0] = 1.0
        x = np.linalg.lstsq(W / scale, np.concatenate(rights), rcond=1e-9)[0] / scale
        sigma = sigma.copy()
        for j, p in enumerate(chosen):
            left = (
                design.columns[j][rows, -1]
                - design.columns[j][rows][:, p.local] @ p.mix @ x[p.unknown]
            )
            for region in range(sigma.shape[1]):
                here = design.region[rows, j] == region
                if here.any():
                    sigma[j, region] = np.sqrt(np.mean(left[here] ** 2))
    return sigma


def log_likelihood(sigma, counts):
    per_joint = (np.log(sigma) * counts).sum(axis=1) / counts.sum(axis=1)
    return -float(per_joint.sum())


def test_scores_agree_with_refitting_everything_from_the_rows(nothing_hidden):
    found = nothing_hidden
    for score in (found.first_scores[0], found.first_scores[-1]):
        design = build_design_matrix(found.rows, found.start.model, [score.candidate])
        with_it = replace(score.fit.structure, effects=(design.index[0],))
        before = brute_force(design, found.start.fit.structure, found.start.fit.sigma)
        after = brute_force(design, with_it, found.start.fit.sigma)
        counts = score.fit.counts
        gain = log_likelihood(after, counts) - log_likelihood(before, counts)
        assert score.gain == pytest.approx(gain, abs=2e-3)


def test_nothing_is_named_where_nothing_is_hidden(nothing_hidden):
    verdict = nothing_hidden.verdict
    assert verdict.kind == Kind.NO_GAP
    assert (verdict.effects, verdict.transients, verdict.faults) == ((), (), ())


def test_a_weaker_effect_is_found_behind_one_that_chance_explains_as_well(source, monkeypatch):
    """Effect-free arms raise the threshold of what explains most beyond what it gains here."""
    arm = wam()
    for name, joint, values in (("torque_offset", 3, [2.0]), ("joint_spring", 1, [3.0, 0.0])):
        effect = catalogue()[name]
        place = next(h for h in effect.candidates(facts_of(source)) if h.joints == (joint,))
        arm = effect.simulated(arm, place, np.array(values))

    def calibrated(source, state, *rest):
        gains = state.threshold.gain | {"torque_offset": np.inf}
        return replace(state.threshold, gain=gains, draws=1)

    monkeypatch.setattr("ident.gap.search.calibrated", calibrated)
    found = search(source_of(recorded(arm, moving=(1, 3))), Options(), lambda _: None)
    assert [f.candidate.effect for f in found.verdict.effects] == ["joint_spring"]


def test_a_torque_at_one_place_gets_no_wrong_name(bumpy):
    found = search(source_of(bumpy), Options(null_runs=1), lambda _: None)
    assert found.verdict.kind == Kind.UNKNOWN
    assert {n.structure.joint for n in found.verdict.unexplained} >= {3}


def test_a_gap_at_a_light_joint_is_not_lost_beside_the_heavy_ones():
    log = recorded(wam(Term(cord, 6, (0.0005,))))
    found = search(source_of(log), Options(null_runs=0), lambda _: None)
    (effect,) = found.verdict.effects
    assert (effect.candidate.effect, effect.joints) == ("joint_spring", (6,))
    count = len(found.rows.base_parameters)
    before, after = (feasible_fit(found.source, p.fit, count).x for p in (found.start, found.end))
    both = before_and_after(found, before, after)
    first = gap_location(found, both)[0]
    assert (first.joint, first.region[:6]) == (6, "|qd| >")
    assert first.share > 0.9
    loud = held_out(found, replace(both, floor=np.full((7, len(Region)), 1e3)))
    assert loud.noise_floor is None  # no floor lies so far above the error that a fit leaves
    assert loud.closed > 0.5


def test_errors_and_gap_of_an_effect_free_arm(nothing_hidden):
    found = nothing_hidden
    x = feasible_fit(found.source, found.start.fit, len(found.rows.base_parameters)).x
    both = before_and_after(found, x, x)
    errors = held_out(found, both)
    assert errors.before.relative_percent == errors.after.relative_percent
    assert errors.noise_floor is not None
    assert errors.noise_floor.relative_percent < errors.before.relative_percent
    assert gap_location(found, both) == []
    assert errors.closed == 0.0


def test_a_motion_that_comes_again_is_known_without_its_file(nothing_hidden, plain):
    told = nothing_hidden.source
    bare = source_of(replace(plain, attachments={"robot.urdf": plain.attachments["robot.urdf"]}))
    by_file, by_motion = (repeated_rows(s, nothing_hidden.rows, Repeats()) for s in (told, bare))
    assert len(by_file[0]) > 300
    for with_file, without in zip(by_file, by_motion, strict=True):
        np.testing.assert_array_equal(with_file, without)


def test_a_motion_that_never_comes_again_has_no_repeats(plain):
    half = len(plain.q) // 2
    command = plain.command
    once = replace(
        plain,
        stamp_ns=plain.stamp_ns[:half],
        q=plain.q[:half],
        command=replace(
            command,
            stamp_ns=command.stamp_ns[:half],
            q=None,
            qd=None,
            effort=command.effort[:half],
        ),
        reference=None,
        attachments={"robot.urdf": plain.attachments["robot.urdf"]},
    )
    source = source_of(once)
    rows, _ = nominal_of(source)
    assert len(repeated_rows(source, rows, Repeats())[0]) == 0


def test_the_error_falls_step_by_step_from_the_rigid_body(nothing_hidden):
    rigid, first, second = error_by_term(nothing_hidden)
    assert rigid.added == "rigid_body"
    assert {first.added, second.added} == {"coulomb", "viscous"}
    assert rigid.relative_percent > first.relative_percent > 3 * second.relative_percent
    x = nothing_hidden.start.fit.x
    fitted = held_out(
        nothing_hidden, before_and_after(nothing_hidden, x, x)
    ).before.relative_percent
    assert second.relative_percent == pytest.approx(fitted, rel=1e-3)


def test_repeated_samples_are_mended_and_no_fault(plain):
    q, effort = plain.q.copy(), plain.command.effort.copy()
    places_ = np.arange(2000, len(q) - 2000, 17)
    q[places_], effort[places_] = q[places_ - 1], effort[places_ - 1]
    source = source_of(replace(plain, q=q, command=replace(plain.command, effort=effort)))
    mended = examine(source.arm, source.datasets)
    assert [r.code for r in mended.remarks] == ["missing_data"]
    assert data_faults(mended.data) == []


def test_skipped_samples_on_even_stamps_are_a_fault_of_the_data(plain):
    keep = np.ones(len(plain.q), dtype=bool)
    keep[2000:-2000:97] = False
    q = np.concatenate([plain.q[keep], np.repeat(plain.q[-1:], int((~keep).sum()), axis=0)])
    (fault,) = data_faults(source_of(replace(plain, q=q)).datasets)
    assert fault.count > 100
    assert data_faults(source_of(plain).datasets) == []


def test_a_clock_that_jitters_is_no_fault(plain):
    """A poll that comes late reads what the arm did meanwhile; the next step is shorter."""
    late_s = np.random.default_rng(0).uniform(0.0, 0.002, len(plain.q))
    t = np.arange(len(plain.q)) * 0.002
    q = np.column_stack([np.interp(t + late_s, t, joint) for joint in plain.q.T])
    assert data_faults(source_of(replace(plain, q=q)).datasets) == []


def test_missing_stamps_are_no_fault(plain):
    missing = plain.stamp_ns.copy()
    for k in range(100, len(missing) - 100, 100):
        missing[k:] += 2_000_000
    assert data_faults(source_of(replace(plain, stamp_ns=missing)).datasets) == []


def test_a_recording_in_which_joints_are_held_does_not_spoil_another(source):
    """What holds them may be any torque up to their dry friction, for thousands of rows."""
    both = experiment([*source.recordings, recorded(wam(), moving=[6])], ["log.mcap", "other.mcap"])
    noise = []
    for logs in (source, both):
        noise.append(nominal_of(logs)[1].fit.sigma[:, Region.SLIDING])
    held = [0, 1, 2, 3, 5]  # the fifth is dragged along by the last one, in jerks
    assert (noise[1] < 1.2 * noise[0])[held].all()


@pytest.mark.thorough
def test_of_three_recordings_only_one_may_tell_the_parameters_apart(plain):
    """Two move one joint each; a spring at one of them is named all the same."""

    def sprung(recording):
        effort = recording.command.effort.copy()
        effort[:, 4] += 0.05 * recording.q[:, 4]
        return replace(recording, command=replace(recording.command, effort=effort))

    logs = [plain, *(recorded(wam(), 1, [joint]) for joint in (0, 4))]
    three = experiment([sprung(r) for r in logs], ["all.mcap", "1.mcap", "5.mcap"])
    found = search(three, Options(null_runs=1), lambda _: None).verdict
    assert (found.kind, [e.place for e in found.effects]) == (Kind.NAMED, [("joint_spring", (4,))])


@pytest.mark.thorough
def test_an_effect_counts_for_the_joints_that_pay_for_it_where_it_is_left_out(plain):
    """Weight of the lower arm makes up for a gain of its joint, and puts the error at others."""

    def scaled(recording):
        effort = recording.command.effort.copy()
        effort[:, 3] *= 1.04
        return replace(recording, command=replace(recording.command, effort=effort))

    logs = [scaled(plain), scaled(recorded(wam(), 1, [3], slower=4.0))]
    both = experiment(logs, ["all.mcap", "4.mcap"])
    found = search(both, Options(null_runs=1), lambda _: None).verdict
    assert (found.kind, [e.place for e in found.effects]) == (Kind.NAMED, [("torque_gain", (3,))])
