"""Mutated logs through `ident run` or `ident gap`: bugs, hangs, memory, and what is believed.

Usage: OMP_NUM_THREADS=1 python scripts/benchmarks/mutated_logs.py [LOG.mcap] --command run|gap
       [--count 300] [--first 0] [--seed 0] [--seconds 12] [--verbose]

A stretch of LOG.mcap, or of a double pendulum with friction, is mutated `count` times: bytes of the
file, stamps, positions, torque, joints and topics, one or two mutations each. Every case is a
process of its own that may have 2 GB and 60 s of a core; it is forked from this one, which has run
the command once. A line for each that ends otherwise than with 0 or 6, is called trustworthy, or
has a name for an effect that the unmutated log has not (`--verbose`: for each), and a table at the
end: exit codes, verdicts by mutation, peak memory, processor time. Ctrl-C ends it with the table so
far.

What `run` calls trustworthy is judged by the unmutated log: its model is garbage if there, at some
joint, it leaves over more than 5 % of the torque beyond what the unmutated log's model does, and if
some base parameter is off by more than three combined standard errors. Where zeros were shifted,
the unmutated log is shifted alike: the model is one of the joints as the encoders have them. An
effect that `gap` names in a mutated log, and not in the unmutated one, is new: whether the mutation
is what it names is for the reader to judge.
"""

import argparse
import json
import os
import resource
import struct
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import numpy as np

from ident.cli import main as ident
from wamctl.arm.recorder import Recorder
from wamctl.arm.recording import read_recording
from wamctl.arm.robot import inverse_dynamics, load_robot

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from pendulum import pendulum

Rng = np.random.Generator
MOST_BYTES, MOST_S = 2 << 30, 60
MOST_OFF, MOST_SD = 5.0, 3.0  # percent of a joint's torque; combined standard errors
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


def _drop(case: Case, keep: np.ndarray) -> Case:
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
    "cut short": lambda c, r: _drop(c, np.arange(max(2, int(len(c.t) * r.random() ** 2)))),
    "hole": lambda c, r: replace(c, t=c.t + np.where(
        np.arange(len(c.t)) > r.integers(len(c.t)), int(10 ** r.uniform(7, 16.5)), 0)),
    "lost": lambda c, r: _drop(c, r.random(len(c.t)) > r.uniform(0, 0.9)),
    "thinned": lambda c, r: _drop(c, np.arange(0, len(c.t), r.integers(2, 200))),
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
            recorder.cycle(int(np.clip(t, 0, MOST_NS)), q, q, tau, q, q, q, tau)


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


def _child(words: list[str], said: int) -> None:
    """A command, in a process that has just been forked; does not return."""
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_S, MOST_S))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(said, 2)
        code = called(words)
    finally:
        os._exit(code)


def called(words: list[str]) -> int:
    """The exit code of a command in this process."""
    sys.argv[:] = ["ident", *words]
    try:
        ident()
    except SystemExit as done:
        return int(done.code or 0)
    return 0


@dataclass(frozen=True)
class Ended:
    """Exit code, peak memory [MB], last line, and result of a command (empty without one)."""

    code: int
    memory: float
    said: str
    result: dict[str, Any]

    @property
    def effects(self) -> set[str]:
        """What `gap` names."""
        found = self.result.get("effects", []) if self.result.get("verdict") == "named" else []
        return {f"{e['name']}{e['joints']}" for e in found}

    @property
    def verdict(self) -> str:
        """In words."""
        words = [str(self.result.get(key, "")) for key in ("trust", "verdict")]
        return " ".join(filter(None, [*words, "+".join(sorted(self.effects))]))


def ended(command: str, words: list[str], out: Path) -> Ended:
    """How a command ends."""
    with TemporaryFile() as stream:
        pid = os.fork()
        if pid == 0:
            _child([command, *words, "--out", str(out)], stream.fileno())
        _, status, usage = os.wait4(pid, 0)
        stream.seek(0)
        said = stream.read().decode(errors="replace")
    file, result = out / f"{command}.json", {}
    if file.exists():
        result = json.loads(file.read_text())
        file.unlink()
    code = os.waitstatus_to_exitcode(status)
    return Ended(code, usage.ru_maxrss / 1024, said.strip().split("\n")[-1], result)


class Judge:
    """Compares what is believed with what the unmutated log says."""

    def __init__(self, command: str, head: Head, whole: Case, path: Path, out: Path) -> None:
        self._head, self._samples, self._whole, self._out = head, whole, path, out
        self.unchanged = ended(command, [str(path)], out)
        self._left = self._left_over() if command == "run" else np.empty(0)

    def _left_over(self) -> np.ndarray:
        """Error of the last model on the unmutated log, by joint [%]."""
        words = [str(self._whole), "--model", str(self._out / "model.yaml")]
        found = ended("validate", words, self._out.with_name("validated"))
        (log,) = found.result["logs"]
        return np.array(log["relative_error_percent_by_joint"])

    def judged(self, found: Ended, shift: np.ndarray) -> str:
        """What is to be said of a result; empty where nothing is believed.

        Args:
            found: the result.
            shift: of the joints' zeros, shape (n,) [rad].
        """
        if new := found.effects - self.unchanged.effects:
            return f"new: {'+'.join(sorted(new))}"
        if found.result.get("verdict") != "trustworthy" or not len(self._left):
            return ""
        write(self._whole, self._head, replace(self._samples, q=self._samples.q + shift))
        off = np.sqrt(np.maximum(self._left_over() ** 2 - self._left**2, 0.0))
        a, b = (
            {p["name"]: p for p in r.result["base_parameters"]} for r in (found, self.unchanged)
        )
        sds = [
            abs(a[name]["ols"] - b[name]["ols"]) / np.hypot(a[name]["sd"], b[name]["sd"])
            for name in a.keys() & b.keys()
        ]
        is_bad = off.max() > MOST_OFF and max(sds) > MOST_SD
        of_joint = f"{off.max():.1f} % at joint {off.argmax() + 1}, {max(sds):.1f} standard errors"
        return f"{'GARBAGE' if is_bad else 'right'}: {of_joint}"


def mutated(whole: Case, rng: Rng) -> tuple[Case, list[str]]:
    """A case with one or two mutations, and their names."""
    chosen = [str(x) for x in rng.choice(list(MUTATIONS), rng.integers(1, 3), False)]
    case = whole
    with np.errstate(all="ignore"):
        for mutation in chosen:
            case = MUTATIONS[mutation](case, rng) if len(case.t) > 1 else case
    return case, chosen


def main() -> None:
    """Mutate, run, and count."""
    parser = argparse.ArgumentParser(description="Mutated logs through a command.")
    parser.add_argument("log", type=Path, nargs="?")
    parser.add_argument("--command", choices=["run", "gap"], default="run")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=12.0)
    parser.add_argument("--verbose", action="store_true")
    given = parser.parse_args()
    log, whole = of_file(given.log) if given.log else of_pendulum(given.seconds)
    whole = _drop(whole, whole.t < whole.t[0] + given.seconds * 1e9)
    codes, verdicts, most = Counter(), Counter(), 0.0
    with TemporaryDirectory() as name:
        path, out = Path(name) / "log.mcap", Path(name) / "out"
        unchanged = Path(name) / "unchanged.mcap"
        write(unchanged, log, whole)
        with open(os.devnull, "w") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
            first = [given.command, str(unchanged), "--out", str(out)]
            called(first)  # loads and compiles what all cases need
        judge = Judge(given.command, log, whole, unchanged, out)
        print(f"unchanged: {judge.unchanged.verdict}", flush=True)
        with suppress(KeyboardInterrupt):
            for k in range(given.first, given.first + given.count):
                rng = np.random.default_rng([given.seed, k])
                case, chosen = mutated(whole, rng)
                write(path, log, case)
                if rng.random() < 0.25:
                    chosen.append(bend(path, rng))
                found = ended(given.command, [str(path)], out)
                shift = case.q[0] - whole.q[0] if "shifted zero" in chosen else 0.0 * whole.q[0]
                judged = judge.judged(found, shift)
                codes[found.code] += 1
                verdicts[(" + ".join(chosen), f"{found.verdict} {judged}".strip())] += 1
                most = max(most, found.memory)
                is_bad = found.code not in (0, 6) or found.memory * 2**20 > MOST_BYTES
                if is_bad or judged or given.verbose:
                    what = f"exit {found.code}, {found.memory:.0f} MB, {found.verdict}"
                    print(f"case {k}: {chosen}: {what}: {judged or found.said}", flush=True)
                path.unlink()
    for (what, verdict), count in sorted(verdicts.items()):
        print(f"{count:4d} {what}: {verdict or 'no result'}")
    cpu_s = sum(os.times()[:4]) / max(1, codes.total())
    print(f"exit codes {dict(codes)}, peak memory {most:.0f} MB, {cpu_s:.2f} s of a core a case")


if __name__ == "__main__":
    main()
