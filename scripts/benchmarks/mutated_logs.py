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

What `run` calls trustworthy is judged by the unmutated log, at the cut-off of its own fit: its
model is garbage if there, at some joint, it leaves over more than 5 % of the torque beyond what the
unmutated log's model does, and if some base parameter is off by more than three combined standard
errors. A model that cannot be compared counts as garbage, too, with the reason. Where zeros were
shifted, the unmutated log is shifted alike: the model is one of the joints as the encoders have
them. An effect that `gap` names in a mutated log, and not in the unmutated one, is new: whether the
mutation is what it names is for the reader to judge.
"""

import argparse
import json
import os
import resource
import sys
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import numpy as np
from log_mutations import Case, Head, bend, dropped, mutated, of_file, of_pendulum, write

from ident.cli import main as ident

MOST_BYTES, MOST_S = 2 << 30, 60
MOST_OFF, MOST_SD = 5.0, 3.0  # percent of a joint's torque; combined standard errors


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
        self._left = self._left_over()[0] if command == "run" else np.empty(0)

    def _left_over(self) -> tuple[np.ndarray, str]:
        """Error of the last model on the unmutated log, by joint [%]; or why it has none."""
        words = [str(self._whole), "--model", str(self._out / "model.yaml")]
        words += ["--cutoff", str(self.unchanged.result["cutoff_hz"])]
        found = ended("validate", words, self._out.with_name("validated"))
        errors = [log["relative_error_percent_by_joint"] for log in found.result.get("logs", [])]
        return np.concatenate(errors) if errors else np.empty(0), found.said

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
        left, said = self._left_over()
        if not len(left):
            return f"GARBAGE: {said}"
        off = np.sqrt(np.maximum(left**2 - self._left**2, 0.0))
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
    whole = dropped(whole, whole.t < whole.t[0] + given.seconds * 1e9)
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
