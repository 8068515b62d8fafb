"""What the experiment puts on the bus of CANopen drives."""

from wamctl.arm.config import BusSection, CanopenDrivesSection
from wamctl.canopen import pdo
from wamctl.drives.bus_load import Load, Traffic, load


def plan(bus: BusSection, drives: CanopenDrivesSection) -> Load:
    """SYNC, positions and torques of every cycle, and heartbeats."""
    rate, n = 1.0 / bus.period_s, len(drives.node_ids)
    wirings = [pdo.wiring(drives, slot) for slot in range(n)]
    torques = {p.cob_id: p for w in wirings for p in w.received if p.transmission == pdo.EVERY_SYNC}
    sent = [p for w in wirings for p in w.sent]
    answers = [Traffic("answer", rate, p.length) for p in sent if p.transmission == pdo.EVERY_SYNC]
    events = [Traffic("temperatures", 1000.0 / p.event_ms, p.length) for p in sent if p.event_ms]
    return load(
        bus,
        [Traffic("SYNC", rate, 0), *answers],
        [Traffic("torque", rate, p.length) for p in torques.values()],
        [Traffic("heartbeat", (n + 1) * 1000.0 / drives.heartbeat_ms, 1), *events],
    )
