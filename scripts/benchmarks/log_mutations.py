"""Mutations of a log: bytes of the file, stamps, positions, torque, joints and topics."""

import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.recording import read_recording
from wamctl.arm.robot import inverse_dynamics, load_robot

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from pendulum import pendulum

Rng = np.random.Generator
MOST_NS = 2**31 * 10**9 - 1
HZ, PARTS, NOISE_NM = 200, 8, 0.01


@dataclass(frozen=True)
class Head:
    """What a log says besides its samples."""

    joints: Sequence[str]
    metadata: Mapping[str, str]
    attachments: Mapping[str, bytes]


@dataclass(frozen=True)
class Case:
    """Samples of a log: stamps [ns], positions and torques of shape (S, n)."""

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray


Mutation = Callable[[Case, Rng], Case]


def _some(rng: Rng, case: Case) -> slice:
    """A random stretch."""
    a, b = np.sort(rng.integers(0, len(case.t), 2))
    return slice(int(a), int(b) + 1)


def _changed(array: np.ndarray, place: Any, value: Any) -> np.ndarray:
    result = array.copy()
    result[place] = value
    return result


def dropped(case: Case, keep: np.ndarray) -> Case:
    """Some of its samples alone."""
    return Case(case.t[keep], case.q[keep], case.tau[keep])


def _huge(case: Case, rng: Rng) -> Case:
    value = rng.choice([1e300, -1e300, 1e30, 1e6, np.nan, np.inf])
    place = (int(rng.integers(len(case.t))), int(rng.integers(case.q.shape[1])))
    if rng.random() < 0.5:
        return replace(case, q=_changed(case.q, place, value))
    return replace(case, tau=_changed(case.tau, place, value))


def _flipped(case: Case, rng: Rng) -> Case:
    """Ten flipped bits among the numbers."""
    arrays = [case.q.copy(), case.tau.copy()]
    for _ in range(10):
        bits = arrays[rng.integers(2)].reshape(-1).view(np.uint64)
        bits[rng.integers(len(bits))] ^= np.uint64(1) << np.uint64(rng.integers(64))
    return replace(case, q=arrays[0], tau=arrays[1])


def _order(array: np.ndarray, rng: Rng) -> np.ndarray:
    """The joints' columns, each in another's place."""
    return np.roll(array, rng.integers(1, array.shape[1]), axis=1)


def _reversed(case: Case, rng: Rng) -> Case:
    """The torque of one joint or more."""
    signs = rng.choice([-1, 1], case.tau.shape[1])
    signs[rng.integers(len(signs))] = -1
    return replace(case, tau=case.tau * signs)


def _two_arms(case: Case, rng: Rng) -> Case:
    """Another arm on the same topic, 0.5 rad away."""
    return Case(
        np.repeat(case.t, 2) + np.tile([0, 1_000_000], len(case.t)),
        np.repeat(case.q, 2, axis=0) + np.tile([[0.0], [0.5]], (len(case.q), 1)),
        np.repeat(case.tau, 2, axis=0),
    )


MUTATIONS: dict[str, Mutation] = {
    "cut short": lambda c, r: dropped(c, np.arange(max(2, int(len(c.t) * r.random() ** 2)))),
    "hole": lambda c, r: replace(c, t=c.t + np.where(
        np.arange(len(c.t)) > r.integers(len(c.t)), int(10 ** r.uniform(7, 16.5)), 0)),
    "lost": lambda c, r: dropped(c, r.random(len(c.t)) > r.uniform(0, 0.9)),
    "thinned": lambda c, r: dropped(c, np.arange(0, len(c.t), r.integers(2, 200))),
    "stamps jitter": lambda c, r: replace(c, t=np.sort(c.t + r.integers(0, 10**7, len(c.t)))),
    "stamps back": lambda c, r: replace(c, t=_changed(c.t, r.integers(len(c.t)), 5)),
    "stamps equal": lambda c, r: replace(c, t=_changed(c.t, _some(r, c), c.t[0])),
    "coarse encoder": lambda c, r: replace(c, q=np.round(c.q, r.integers(0, 4))),
    "frozen": lambda c, r: replace(c, q=_changed(c.q, _some(r, c), c.q[0])),
    "still joint": lambda c, r: replace(c, q=_changed(
        c.q, (slice(None), r.integers(c.q.shape[1])), 0.3)),
    "huge": _huge,
    "flipped bits": _flipped,
    "noise as torque": lambda c, r: replace(c, tau=r.normal(size=c.tau.shape) * c.tau.std(0)),
    "noise at a joint": lambda c, r: replace(c, tau=_changed(
        c.tau, (slice(None), k := r.integers(c.q.shape[1])),
        r.normal(size=len(c.t)) * c.tau[:, k].std())),
    "zero torque": lambda c, r: replace(c, tau=0 * c.tau),
    "torque order": lambda c, r: replace(c, tau=_order(c.tau, r)),
    "position order": lambda c, r: replace(c, q=_order(c.q, r)),
    "torque sign": _reversed,
    "degrees": lambda c, r: replace(c, q=np.rad2deg(c.q)),
    "unit": lambda c, r: replace(c, tau=c.tau * 10 ** r.uniform(-6, 6)),
    "shifted zero": lambda c, r: replace(c, q=c.q + r.normal(size=c.q.shape[1])),
    "late torque": lambda c, r: replace(c, tau=np.roll(c.tau, r.integers(5, 500), axis=0)),
    "two arms": _two_arms,
    "slow": lambda c, r: replace(c, t=c.t * int(r.integers(2, 1000))),
}  # fmt: skip


def of_file(path: Path) -> tuple[Head, Case]:
    """A log of `wamctl excite`."""
    log = read_recording(path)
    if log.command is None or log.command.effort is None:
        raise SystemExit("a log of `wamctl excite` is needed")
    head = Head(log.joint_names, log.metadata, log.attachments)
    return head, Case(log.stamp_ns, log.q, log.command.effort)


def of_pendulum(seconds: float) -> tuple[Head, Case]:
    """A double pendulum with friction and some noise of its torque, moved by sines."""
    urdf = pendulum()
    robot = load_robot(urdf)
    t = np.arange(round(seconds * HZ)) / HZ
    tau = np.zeros((len(t), 2))
    for part in (np.arange(PARTS) + 0.5) / PARTS / HZ:  # a torque acts until the next stamp
        q, qd, qdd = _sines(t + part)
        tau += (inverse_dynamics(robot, q, qd, qdd) + 0.4 * np.sign(qd) + 0.3 * qd) / PARTS
    tau += NOISE_NM * np.random.default_rng(0).normal(size=tau.shape)
    head = Head(robot.joint_names, {}, {"robot.urdf": urdf.encode()})
    return head, Case((1e18 + 1e9 * t).astype(np.int64), _sines(t)[0], tau)


def _sines(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and accelerations of two joints, shapes (S, 2)."""
    q, qd, qdd = np.zeros((3, len(t), 2))
    for joint, sines in enumerate([((0.9, 1.9), (0.5, 4.4)), ((1.1, 2.6), (0.4, 6.1))]):
        for size, rate in sines:
            q[:, joint] += size * np.sin(rate * t)
            qd[:, joint] += size * rate * np.cos(rate * t)
            qdd[:, joint] -= size * rate**2 * np.sin(rate * t)
    return q, qd, qdd


def write(path: Path, log: Head, case: Case) -> None:
    """A log with measured torque, and nothing else."""
    with Recorder(path, log.joints, log.metadata, log.attachments) as recorder:
        for t, q, tau in zip(case.t, case.q, case.tau, strict=True):
            stamp_ns = int(np.clip(t, 0, MOST_NS))
            recorder.cycle(CycleRecord(stamp_ns, q, q, tau, q, q, q, tau))


def bend(path: Path, rng: Rng) -> str:
    """Change bytes of a file."""
    data = bytearray(path.read_bytes())
    kind = rng.choice(["bytes", "length", "cut", "swap"])
    places = rng.integers(8, len(data) - 16, rng.integers(1, 12))
    if kind == "bytes":
        for place in places:
            data[place] = rng.integers(256)
    elif kind == "length":
        data[places[0] : places[0] + 8] = struct.pack("<Q", int(rng.integers(2**62)))
    elif kind == "cut":
        del data[int(rng.integers(0, len(data))) :]
    else:
        a, b = sorted(int(p) for p in rng.integers(8, len(data), 2))
        data[a:b] = data[a:b][::-1]
    path.write_bytes(data)
    return f"file: {kind}"


def mutated(whole: Case, rng: Rng) -> tuple[Case, list[str]]:
    """A case with one or two mutations, and their names."""
    chosen = [str(x) for x in rng.choice(list(MUTATIONS), rng.integers(1, 3), False)]
    case = whole
    with np.errstate(all="ignore"):
        for mutation in chosen:
            case = MUTATIONS[mutation](case, rng) if len(case.t) > 1 else case
    return case, chosen
