"""The table of wrong inputs: name, how it is made, and the codes of which one must be said."""

import re
from collections.abc import Callable

import numpy as np
from chain_arm import Experiment, Log, urdf_of
from wrong_inputs import (
    at_joint,
    carried,
    clipped,
    closed_up,
    compensated,
    cut,
    drifting,
    flipped,
    frozen,
    frozen_and_interpolated,
    glitches,
    holed,
    in_turn,
    inertia,
    interleaved,
    late,
    loaded,
    mass,
    mirrored,
    no_inertials,
    of_another_size,
    offset,
    on_one_line,
    reordered,
    rescaled,
    right,
    rough,
    scaled,
    shifted,
    shuffled,
    skipped,
    slipped,
    some_in_degrees,
    spikes,
    stale,
    still,
    stood,
    stretched,
    swaying,
    thinned,
    torque,
    turned,
    urdf,
    weightless,
    without,
)

Wrong = tuple[str, Callable[[], Log], set[str]]

AXIS_3 = re.search(r'name="joint_3".*?<axis xyz="0 1 0"', urdf_of(3), re.S).group()
ANY = {"large_error"}
FLIPPED = (1, 3, 4, 10, 15, 22)
"""Seeds by which bits flip that matter; where none does, nothing has to be said."""

WRONG: list[Wrong] = [
    ("degrees", lambda: right().with_(q=np.rad2deg(right().q)), {"degrees"}),
    (
        "degrees, five joints",
        lambda: right(joints=5).with_(q=np.rad2deg(right(joints=5).q)),
        {"degrees"},
    ),
    ("degrees, short", lambda: cut(8.0).with_(q=np.rad2deg(cut(8.0).q)), {"degrees"}),
    ("turns", lambda: right().with_(q=right().q / (2 * np.pi)), {"units", "cad_disagrees"}),
    (
        "encoder counts",
        lambda: right().with_(q=right().q * 2**17 / (2 * np.pi)),
        {"beyond_limits", "large_error"},
    ),
    ("all torques reversed", lambda: scaled(-1), {"sign"}),
    ("all torques reversed, no friction", lambda: scaled(-1, right(friction=0.0)), {"sign"}),
    ("torque 1 reversed", lambda: turned(0), {"sign"}),
    ("torque 2 reversed", lambda: turned(1), {"sign"}),
    ("torque 3 reversed", lambda: turned(2), {"sign"}),
    ("torques 1 and 3 reversed", lambda: turned(0, 2), {"sign"}),
    ("position 2 reversed", lambda: turned(1, what="q"), {"sign"}),
    ("position 3 reversed", lambda: turned(2, what="q"), {"sign"}),
    *(
        (f"joint {k + 1} of {n} mirrored", lambda k=k, n=n: mirrored(k, n), {"sign"})
        for k, n in ((0, 3), (0, 4), (3, 4), (0, 6))
    ),
    *(
        (
            f"URDF of size {s:g}, {n} joints",
            lambda s=s, n=n: of_another_size(s, n),
            {"cad_disagrees"},
        )
        for s, n in ((0.7, 3), (1.4, 6))
    ),
    *(
        (f"torque {k + 1} by {f:g}", lambda k=k, f=f: rescaled(k, f), {"current_not_torque"})
        for k, f in ((0, 3.0), (1, 0.5), (3, 0.5))
    ),
    ("a load of 10 kg", lambda: loaded(10.0, 6), {"cad_disagrees"}),
    ("N mm", lambda: scaled(1000), {"units"}),
    ("N mm, five joints", lambda: scaled(1000, right(joints=5)), {"units"}),
    *(
        (
            f"torque by {f:g}, of an arm with other masses",
            lambda f=f: scaled(f).with_(urdf=urdf_of(3, np.array([6.0, 0.1, 0.1]))),
            {"units"},
        )
        for f in (1000, 1e-3)
    ),
    ("degrees at joints 3 to 5 of 5", lambda: some_in_degrees(2, 5), {"degrees"}),
    ("degrees at joint 5 of 5", lambda: some_in_degrees(4, 5), {"degrees"}),
    ("kN m", lambda: scaled(1e-3), {"units"}),
    (
        "a URDF whose links predict worse than none",
        lambda: Experiment(true_urdf=urdf_of(3, np.array([2.5, 1.05, 1.2]))).log(),
        {"cad_disagrees"},
    ),
    (
        "a URDF with masses in gram",
        lambda: right().with_(urdf=urdf_of(3, 5000.0 * 0.7 ** np.arange(3))),
        {"cad_disagrees"},
    ),
    ("N cm", lambda: scaled(100), {"units"}),
    ("kgf m", lambda: scaled(1 / 9.81), {"units"}),
    ("kgf cm", lambda: scaled(10.2), {"units"}),
    ("lbf in", lambda: scaled(8.85), {"units"}),
    ("ahead of gears of 50", lambda: scaled(1 / 50), {"units"}),
    ("ampere, one gain", lambda: scaled(0.1), {"units"}),
    ("ampere, a gain a joint", lambda: scaled([0.08, 0.9, 0.11]), {"current_not_torque", "units"}),
    ("a gear of 1.7 for 1", lambda: scaled(1.7), {"units"}),
    ("N m times 3, five joints", lambda: scaled(3.0, right(joints=5)), {"units"}),
    ("N m times 0.55", lambda: scaled(0.55), {"units"}),
    ("N mm and reversed", lambda: scaled(-1000), {"units", "sign"}),
    ("torques 1 and 2 swapped", lambda: reordered((1, 0, 2), "tau"), {"joint_order"}),
    ("torques 2 and 3 swapped", lambda: reordered((0, 2, 1), "tau"), {"joint_order"}),
    ("positions 1 and 2 swapped", lambda: reordered((1, 0, 2), "q"), {"joint_order"}),
    (
        "joints 2 and 3 swapped",
        lambda: reordered((0, 2, 1), "q", "tau"),
        {"joint_order", "zero_pose", "large_error"},
    ),
    ("joints 1 and 3 swapped", lambda: reordered((2, 1, 0), "q", "tau"), {"joint_order"}),
    (
        "joints 2 and 4 of five swapped",
        lambda: reordered((0, 3, 2, 1, 4), "q", "tau", joints=5),
        {"joint_order"},
    ),
    (
        "five joints in reverse order",
        lambda: reordered((4, 3, 2, 1, 0), "q", "tau", joints=5),
        {"joint_order"},
    ),
    (
        "joints shifted by one",
        lambda: reordered((1, 2, 3, 4, 0), "q", "tau", joints=5),
        {"joint_order"},
    ),
    (
        "torques shifted by one",
        lambda: reordered((4, 0, 1, 2, 3), "tau", joints=5),
        {"joint_order"},
    ),
    (
        "percent of each drive's rated torque",
        lambda: scaled([0.5, 0.5, 2.5, 2.5], right(joints=4)),
        {"current_not_torque"},
    ),
    (
        "permille of each drive's rated torque",
        lambda: scaled([5.0, 5.0, 36.0, 36.0], right(joints=4)),
        {"current_not_torque", "units"},
    ),
    (
        "torques of joints 2 and 3 swapped, others rough",
        lambda: rough(reordered((0, 2, 1, 3, 4), "tau", joints=5), 0, 3, 4),
        {"joint_order"},
    ),
    ("torques in reverse order", lambda: reordered((2, 1, 0), "tau"), {"joint_order"}),
    (
        "zero of joint 2 off by 90 degrees",
        lambda: shifted(1, np.pi / 2),
        {"zero_pose", "large_error", "gravity_direction"},
    ),
    ("zero of joint 3 off by -90 degrees", lambda: shifted(2, -np.pi / 2), {"zero_pose"}),
    ("zero of joint 3 off by 0.3 rad", lambda: shifted(2, 0.3), {"zero_pose"}),
    ("zero of joint 2 off by -0.8 rad", lambda: shifted(1, -0.8), {"zero_pose"}),
    (
        "zero of joint 2 off by 180 degrees",
        lambda: shifted(1, np.pi),
        {"zero_pose", "sign", "gravity_direction", "units"},
    ),
    (
        "hangs sideways",
        lambda: Experiment(joints=4, gravity=lambda t: (0, -9.81, 0)).log(),
        {"gravity_direction"},
    ),
    (
        "hangs sideways, x",
        lambda: Experiment(joints=4, gravity=lambda t: (9.81, 0, 0)).log(),
        {"gravity_direction"},
    ),
    (
        "hangs upside down",
        lambda: Experiment(joints=4, gravity=lambda t: (0, 0, 9.81)).log(),
        {"gravity_direction"},
    ),
    (
        "hangs upside down, of other masses, slowly",
        lambda: Experiment(
            joints=3,
            seconds=30.0,
            speed=0.3,
            friction=0.1,
            noise=0.1,
            gravity=lambda t: (0, 0, 9.81),
            true_urdf=urdf_of(3, np.array([7.0, 2.1, 3.7])),
        ).log(),
        {"gravity_direction"},
    ),
    ("a load picked up", lambda: carried(1.0, 0.4, 1.1), {"load_changes"}),
    ("a load put down", lambda: carried(1.0, 0.0, 0.6), {"load_changes"}),
    ("a load carried for a while", lambda: carried(1.5, 0.3, 0.6), {"load_changes"}),
    *(
        (
            f"all torque by {f:g} from the middle on",
            lambda f=f: scaled(np.where(np.arange(len(right().t)) < 900, 1.0, f)[:, None]),
            {"units"},
        )
        for f in (1.15, 0.8)
    ),
    ("a load picked up, six joints", lambda: carried(1.0, 0.6, 1.1, 6), {"load_changes"}),
    ("base sways at 0.7 Hz", lambda: swaying(2.0, 0.7, 0), {"base_moves"}),
    ("base sways at 1.3 Hz", lambda: swaying(1.5, 1.3, 1), {"base_moves"}),
    *(
        (
            f"base tilted by {tilt} degrees",
            lambda tilt=tilt: Experiment(
                joints=4,
                gravity=lambda t: (
                    9.81 * np.sin(np.radians(tilt)),
                    0,
                    -9.81 * np.cos(np.radians(tilt)),
                ),
            ).log(),
            {"gravity_direction"},
        )
        for tilt in (15, 30)
    ),
    ("gravity taken off", lambda: weightless(joints=4), {"gravity_direction"}),
    ("stamps in ms", lambda: right().with_(t=1000 * right().t), {"poor_motion"}),
    ("stamps in a thousandth of s", lambda: right().with_(t=right().t / 1000), {"jumps"}),
    ("samples in no order", shuffled, {"jumps"}),
    ("one second", lambda: cut(1.0), {"too_short"}),
    ("two seconds", lambda: cut(2.0, joints=5), {"too_short"}),
    ("three seconds of seven joints", lambda: cut(3.0, joints=7), {"too_short"}),
    ("half a second", lambda: cut(0.5), {"too_short"}),
    ("fifteen samples", lambda: cut(0.15), {"too_short"}),
    ("all joints together", lambda: in_turn(4), {"poor_motion"}),
    ("all joints on one line, at many speeds", lambda: on_one_line(0.001), {"poor_motion"}),
    ("joint 2 hardly moves", lambda: still(1, reach=0.08), {"poor_motion"}),
    ("two joints hardly move", lambda: still(0, 2, reach=0.07), {"poor_motion"}),
    ("4 Hz", lambda: thinned(25), {"low_rate", "too_short"}),
    ("2.5 Hz", lambda: thinned(40), {"low_rate", "too_short"}),
    ("1 Hz", lambda: thinned(100, seconds=40.0), {"low_rate", "too_short"}),
    ("a hole of 2 s", lambda: holed((4.0, 6.0)), {"missing_data"}),
    (
        "four short holes",
        lambda: holed(*((k, k + 0.15) for k in (2.0, 4.5, 7.0, 9.5))),
        {"missing_data"},
    ),
    ("a second lost, stamps closed up", lambda: closed_up(5.0, 6.0), {"jumps"}),
    ("every seventh sample lost", lambda: without(np.arange(1200) % 7 > 0), {"missing_data"}),
    (
        "a third lost at random",
        lambda: without(np.random.default_rng(0).uniform(size=1200) > 0.33),
        {"missing_data"},
    ),
    ("cut off", lambda: cut(7.0).with_(complete=False), {"cut_log"}),
    ("cut off early", lambda: cut(3.0).with_(complete=False), {"cut_log"}),
    ("6 % repeated readings", lambda: stale(0.06), {"missing_data"}),
    ("6 % repeated positions", lambda: stale(0.06, both=False), {"missing_data"}),
    ("30 % repeated readings", lambda: stale(0.3), {"missing_data"}),
    ("samples lost, stamps even", lambda: skipped(40), {"missing_data", "jumps"}),
    ("equal stamps", lambda: right().with_(t=np.repeat(right().t[::2], 2)), {"missing_data"}),
    ("all stamps equal", lambda: right().with_(t=np.zeros(1200)), {"unreadable"}),
    ("torque sensors freeze", lambda: frozen(0, 1, 2), {"missing_data"}),
    ("the torque sensor of joint 2 freezes", lambda: frozen(1), {"missing_data"}),
    ("it freezes, and is interpolated", lambda: frozen_and_interpolated(1), {"missing_data"}),
    ("the encoder of joint 2 slips", lambda: slipped(1, 0.15), {"jumps"}),
    ("the encoder of joint 3 stands still", lambda: stood(2, 500, 640), {"jumps"}),
    ("zero effort", lambda: torque(lambda g, r: 0 * g.tau), {"zero_effort"}),
    ("zero effort of joint 2", lambda: at_joint(1, lambda g, r: np.zeros(1200)), {"zero_effort"}),
    ("constant effort", lambda: torque(lambda g, r: 0 * g.tau + [1.0, 2.0, 3.0]), {"zero_effort"}),
    ("noise as torque", lambda: torque(lambda g, r: r.normal(size=g.tau.shape)), ANY),
    ("noise as torque of joint 3", lambda: at_joint(2, lambda g, r: 5 * r.normal(size=1200)), ANY),
    (
        "velocity as torque",
        lambda: torque(lambda g, r: np.gradient(g.q, g.t, axis=0)),
        {"cad_disagrees", "units"},
    ),
    ("position as torque", lambda: torque(lambda g, r: g.q.copy()), ANY | {"units", "sign"}),
    ("torque of another recording", lambda: torque(lambda g, r: Experiment(seed=7).log().tau), ANY),
    (
        "torque half a second late",
        lambda: torque(lambda g, r: np.roll(g.tau, 50, axis=0)),
        {"late_torque"},
    ),
    ("torque 0.12 s late", lambda: late(12), {"late_torque"}),
    ("torque 0.06 s early", lambda: late(-6, joints=5, seconds=20.0), {"late_torque"}),
    (
        "torque 3 0.12 s late, others rough",
        lambda: rough(late(12, 2, joints=4, seconds=24.0), 0, 3),
        {"late_torque"},
    ),
    ("torque 2 0.12 s late", lambda: late(12, 1), {"late_torque"}),
    *(
        (f"flipped bits, seed {k}", lambda k=k: flipped(k), {"glitches", "beyond_limits"})
        for k in FLIPPED
    ),
    *(
        (f"torque spikes of {d} deviations", lambda d=d: spikes(d), {"glitches"})
        for d in (5, 10, 30)
    ),
    ("a position wraps twice", lambda: glitches(1, 2), {"glitches"}),
    ("friction of joint 3 compensated twice", lambda: compensated(2), {"driving_friction"}),
    ("positions times 0.9", lambda: stretched(0.9), {"positions"}),
    ("positions times 1.1, six joints", lambda: stretched(1.1, joints=6), {"positions"}),
    ("position 2 times 0.9", lambda: stretched(0.9, 1), {"positions"}),
    ("position 4 times 1.1", lambda: stretched(1.1, 3, joints=4), {"positions"}),
    ("encoder 2 drifts", lambda: drifting(1, 0.3), {"positions"}),
    ("encoder 3 drifts back", lambda: drifting(2, -0.3, joints=4), {"positions"}),
    ("50 N m at joint 4", lambda: offset(3, 50.0, joints=4), {"torque_range"}),
    ("-50 N m at joint 1", lambda: offset(0, -50.0), {"torque_range"}),
    ("torque clipped at half", lambda: clipped(0.5), {"torque_range"}),
    ("torque clipped at 0.8", lambda: clipped(0.8, joints=5), {"torque_range"}),
    (
        "torque rectified",
        lambda: torque(lambda g, r: np.abs(g.tau)),
        ANY | {"zero_pose", "sign", "torque_range"},
    ),
    ("no inertials", lambda: urdf(no_inertials), {"no_inertials"}),
    (
        "placeholders of 1 kg",
        lambda: urdf(
            lambda u: re.sub(
                r'ixx="[^"]*" iyy="[^"]*" izz="[^"]*"',
                'ixx="1" iyy="1" izz="1"',
                re.sub(r'mass value="[^"]*"', 'mass value="1"', u),
            )
        ),
        {"no_inertials"},
    ),
    (
        "negative mass of link 2",
        lambda: urdf(lambda u: mass(u, 1, -2.0)),
        {"impossible_link", "unreadable"},
    ),
    (
        "negative mass of link 3",
        lambda: urdf(lambda u: mass(u, 2, -0.5)),
        {"impossible_link", "unreadable"},
    ),
    ("negative inertia", lambda: urdf(inertia), {"impossible_link", "unreadable"}),
    ("two arms in turn", interleaved, {"jumps"}),
    ("an encoder that wraps", lambda: glitches(1, 30), {"jumps", "beyond_limits"}),
    (
        "another arm's URDF",
        lambda: right().with_(urdf=right().urdf.replace(AXIS_3, AXIS_3.replace("0 1 0", "1 0 0"))),
        ANY | {"zero_pose", "gravity_direction", "joint_order", "cad_disagrees"},
    ),
]
