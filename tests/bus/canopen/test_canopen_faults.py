"""What goes wrong on the bus, and how the experiment ends."""

import numpy as np
import pytest

from sim_bus.canopen.ds402 import State
from tests.bus.buses import on_buses, on_embedded_bus

BEGINS = {"after": "enabled", "cycles": 60}
PERIOD_NS = 2_000_000
DISABLED_WITHIN_NS = 100_000_000


def quiet_after_ns(arm, began_ns: int) -> int:
    """Time from an instant to the last torque [ns]."""
    return max(t for t, torques in arm.witness.torques if any(torques)) - began_ns


def began_ns(arm) -> int:
    """When all drives were enabled, plus the delay of `BEGINS`."""
    enabled = next(t for t, torques in arm.witness.torques if any(torques))
    return enabled + (BEGINS["cycles"] - 1) * PERIOD_NS


FAULTS = [
    (
        {"fault": "drive_fault", "node": 3, "code": 0x2310},
        4,
        "drive 3 (node 3) reported EMCY 0x2310, over-current, i2t limit",
        3,
    ),
    (
        {"fault": "emergency", "node": 5, "code": 0x4210},
        4,
        "drive 5 (node 5) reported EMCY 0x4210, amplifier over-temperature",
        3,
    ),
    (
        {"fault": "under_voltage", "node": 1},
        4,
        "drive 1 (node 1) reported EMCY 0x3220, bus under-voltage",
        3,
    ),
    (
        {"fault": "silent_drive", "node": 2},
        4,
        "no position from drive 2 (node 2) in 8 cycles (limit 8)",
        10,
    ),
    (
        {"fault": "dead_drive", "node": 7},
        4,
        "no position from drive 7 (node 7) in 8 cycles (limit 8)",
        10,
    ),
    ({"fault": "bus_off", "node": "host"}, 4, "went bus-off", 10),
    (
        {"fault": "encoder_jump", "node": 4, "counts": 1000},
        5,
        "position of motor 4 jumped by 1.5",
        3,
    ),
    (
        {"fault": "lost_frames", "id": 0x186, "number": 1000},
        4,
        "no position from drive 6 (node 6) in 8 cycles (limit 8)",
        10,
    ),
    (
        {"fault": "doubled_frames", "id": 0x183, "number": 1000},
        4,
        "two positions at once from drive 3 (node 3) in 8 cycles (limit 8)",
        10,
    ),
    (
        {"fault": "reordered_frames", "id": 0x183, "number": 1000},
        4,
        "positions from drive 3 (node 3) came behind those that follow them "
        "(safety.answers_in_order) in 8 cycles (limit 8)",
        10,
    ),
]
OF_THE_KERNEL = ("bus_off", "silent_drive")


@on_buses(
    "word",
    ("fault", "exit_code", "cause", "cycles_to_notice"),
    FAULTS,
    lambda case: case[0]["fault"] in OF_THE_KERNEL,
)
def test_a_fault_ends_in_a_defined_stop(serve_arms, fault, exit_code, cause, cycles_to_notice):
    with serve_arms(fault | BEGINS) as arm:
        arm.expected = set(State)
        done = arm.excite()
    assert arm.said
    assert done.error.exit_code == exit_code
    assert cause in str(done.error)
    assert "in phase 'approach': the drives were" in str(done.error)
    noticed = began_ns(arm) + cycles_to_notice * PERIOD_NS
    assert quiet_after_ns(arm, noticed) <= DISABLED_WITHIN_NS
    assert len(done.recording.q) > BEGINS["cycles"]
    assert np.isfinite(done.recording.q).all()


@pytest.mark.parametrize("wiring", ["group_pdos", "pdo_per_drive"])
@on_embedded_bus("word")
def test_a_stop_does_not_wait_for_the_next_sync(serve_arms, wiring):
    jump = {"fault": "encoder_jump", "node": 4, "counts": 1000} | BEGINS
    with serve_arms(jump, drives={"wiring": wiring}) as arm:
        arm.excite()
    last_ns = began_ns(arm) + quiet_after_ns(arm, began_ns(arm))
    cycle_ns = max(t for t in arm.witness.sync_ns if t < last_ns)
    assert last_ns - cycle_ns < 0.75 * PERIOD_NS


def test_answers_that_always_come_too_late_stop_the_arm(serve_arms):
    fault = {"fault": "late_frames", "id": 0x183, "number": 1000, "late_ms": 3.0}
    with serve_arms(fault | BEGINS) as arm:
        done = arm.excite()
    assert done.error.exit_code == 4
    # In lockstep the kernel's vcan has no time stamps: there the order of the answers tells.
    cause = {
        "simbus": "positions from drive 3 (node 3) came too late for their cycle in 8 cycles",
        "socketcan": "positions from drive 1 (node 1), drive 2 (node 2) came behind those that",
    }
    assert cause[arm.word.partition(":")[0]] in str(done.error)
    assert quiet_after_ns(arm, began_ns(arm) + 10 * PERIOD_NS) <= DISABLED_WITHIN_NS


@on_embedded_bus("word")
def test_answers_out_of_turn_may_be_allowed(serve_arms):
    fault = {"fault": "reordered_frames", "id": 0x183, "number": 100_000} | BEGINS
    with serve_arms(fault, safety={"answers_in_order": False}) as arm:
        done = arm.excite()
    assert done.error is None
    assert done.summary.frames.reordered > 1000


@on_embedded_bus("word")
def test_the_log_says_why_it_ended(serve_arms):
    with serve_arms({"fault": "encoder_jump", "node": 4, "counts": 1000} | BEGINS) as arm:
        done = arm.excite()
    name, message = last_diagnostics(arm.path.with_name("log.mcap"))
    assert name == "experiment"
    assert str(done.error).startswith(f"{message.removesuffix('.')}; the log ")


def last_diagnostics(path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        messages = [m for *_, m in reader.iter_decoded_messages(topics=["/diagnostics"])]
    status = messages[-1].status[0]
    return status.name, status.message


@on_embedded_bus("word")
@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (
            {"fault": "wrong_identity", "node": 2, "vendor": 0x123, "product": 0x9},
            "drive 2 (node 2): says vendor 0x123, product 0x9; the configuration says vendor "
            "0x408, product 0x4 (bus {word}). No drive was enabled.",
        ),
        (
            {"fault": "wrong_node", "node": 6, "becomes": 60},
            "drive 6 (node 6): no answer about object 0x1000:0 within 0.3 s, 3 times "
            "(bus {word}). No drive was enabled.",
        ),
    ],
    ids=["wrong_identity", "wrong_node"],
)
def test_other_drives_than_configured_are_refused(serve_arms, fault, sentence):
    with serve_arms(fault) as arm:
        done = arm.excite()
    assert done.error.exit_code == 4
    assert str(done.error) == sentence.format(word=arm.word)
    assert done.recording is None
    assert not any(any(torques) for _, torques in arm.witness.torques)


@on_embedded_bus("word")
def test_an_old_fault_is_reset_and_told_but_nothing_is_enabled(serve_arms):
    notes = []
    fault = {"fault": "drive_fault", "node": 3, "code": 0x8700, "after": "power_on"}
    with serve_arms(fault) as arm:
        done = arm.excite(confirm=lambda connection: notes.append(connection.notes))
    assert done.error is None
    assert notes == [("drive 3 (node 3) was in fault 0x8700 (SYNC lost); it was reset",)]


def test_few_bad_frames_are_counted_and_do_not_stop_the_arm(serve_arms):
    bad = [
        {"fault": "lost_frames", "id": 0x182, "number": 3},
        {"fault": "doubled_frames", "id": 0x185, "number": 5},
        {"fault": "reordered_frames", "id": 0x184, "number": 5},
        {"fault": "corrupted_frames", "id": 0x187, "number": 2, "length": 3},
        {"fault": "lost_frames", "id": 0x200, "number": 4},
    ]
    with serve_arms(*(BEGINS | fault for fault in bad)) as arm:
        done = arm.excite()
    assert done.error is None
    frames = done.summary.frames
    assert frames.lost_by_drive["drive 2 (node 2)"] == 3
    assert frames.lost_by_drive["drive 7 (node 7)"] == 2
    assert frames.lost == 5
    assert frames.malformed == 2
    assert (frames.late, frames.doubled, frames.reordered) == (0, 5, 5)
    assert 0 < done.summary.timing.cycles - done.summary.rows <= 5
