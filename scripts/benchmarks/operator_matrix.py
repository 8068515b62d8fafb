# ruff: noqa: SLF001 - it gives the loop an operator
"""Every key and every signal in every phase: is the arm braked, and is all of it told and logged?

Usage: scripts/benchmarks/operator_matrix.py PROTOCOL [--seed N] [--only NAME...], from the
root, with .venv's Python; PROTOCOL is canopen or puck, NAME a key or signal (ctrl-c, SIGINT).

One experiment with the test of the motors runs in lockstep, in one process, with a terminal of its
own as standard input. In each phase it is forked for each key and signal, which is given there: in
`brake`, ten cycles after another key. An arm is stopped as it should be if the exit code is 5; the
sentence tells what the operator did in this phase; the stop begins in the cycle that follows;
the arm was braked for 0.08 s (not before its motors are tested) and nothing is enabled within
100 ms; and every cycle was logged. While the drives are being disabled nothing can be stopped any
more, and the experiment ends as without the operator; it also does behind a signal that ends no
process, which is given in `release`.
"""

import argparse
import os
import pty
import signal
import sys
import tempfile
import termios
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fault_matrix import PROTOCOLS, configuration
from fault_verdict import MOST_MS, PERIOD_NS, stopped
from fault_witness import Witness
from one_process import Branches, Rig, set_up

from sim_bus.assembly import load_simulation
from wamctl.arm.errors import UserError
from wamctl.errors import StopError
from wamctl.experiment.operator_stop import StopRequest
from wamctl.experiment.preflight import Prepared, prepare
from wamctl.telemetry.status import Phase

MOMENTS = {  # the cycles, counted from the phase's first, from which the moment is drawn
    Phase.ENABLE: (1, 3),
    Phase.TEST: (10, 2000),
    Phase.APPROACH: (10, 700),
    Phase.EXCITE: (10, 1200),
    Phase.RETURN: (10, 700),
    Phase.RELEASE: (10, 450),
    Phase.DISABLE: (1, 1),
    Phase.BRAKE: (10, 10),
}
UNTESTED = (Phase.ENABLE, Phase.TEST)
FIRST_KEY = "the operator stopped it (SIGINT)"
KEYS = {
    **{f"ctrl-{chr(64 + k).lower()}": bytes((k,)) for k in range(32)},
    **{key: key.encode() for key in "q Q 0 ~ é 語".split()},
    **{"space": b" ", "delete": b"\x7f", "byte 128": b"\x80", "byte 255": b"\xff"},
    **{"up": b"\x1b[A", "F1": b"\x1bOP", "alt-x": b"\x1bx", "pasted": 200 * b"text\n"},
}
FATAL = {"SIGKILL", "SIGSTOP", "SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL"}
HARMLESS = {"SIGCHLD", "SIGCONT", "SIGURG", "SIGWINCH", "SIGPIPE", "SIGXFSZ", "SIGTTIN", "SIGTTOU"}


@dataclass(frozen=True)
class Attack:
    """What the operator does.

    Attributes:
        kind: of the table's line.
        name: which.
        cause: as it is to be told; empty for nothing.
        act: does it to this process, whose terminal's other end is given.
    """

    kind: str
    name: str
    cause: str
    act: Callable[[int], object]


def attacks(phase: Phase) -> Iterator[Attack]:
    """All of them; what is harmless only where the experiment is nearly done."""
    for name, typed in KEYS.items():
        yield Attack("keys", name, "the operator pressed a key", lambda m, t=typed: os.write(m, t))
    yield Attack("terminal", "closed", "the terminal was closed", lambda _: close_terminal())
    for number in sorted(signal.valid_signals()):
        name = number.name if isinstance(number, signal.Signals) else f"signal {number}"
        if name in FATAL or (name in HARMLESS and phase is not Phase.RELEASE):
            continue
        cause = f"the operator stopped it ({name})" if name not in HARMLESS else ""
        kind = "signals" if cause else "harmless signals"
        yield Attack(kind, name, cause, lambda _, n=number: os.kill(os.getpid(), n))


def close_terminal() -> None:
    """Standard input is a terminal whose other end is gone."""
    master, terminal = pty.openpty()
    os.dup2(terminal, sys.stdin.fileno())
    os.close(terminal)
    os.close(master)


def missed(
    rig: Rig, witness: Witness, error: UserError | None, phase: Phase, attack: Attack, at_ns: int
) -> list[str]:
    """What of a good ending was missed."""
    last = witness.spans[-1]
    checks = {
        "whole log": rig.log.rows == rig.loop.timing.cycles,
        "disabled for good": not any(last.torques) and not last.enabled,
    }
    goes_on = not attack.cause or phase is Phase.DISABLE
    if goes_on and phase is not Phase.BRAKE:
        return [f"went on: {error}"] if error else [w for w, holds in checks.items() if not holds]
    if not isinstance(error, StopError):
        return [f"no stop: {error}"]
    cause = FIRST_KEY if phase is Phase.BRAKE else attack.cause
    told_ns = witness.first_ns + round(error.at_s * 1e9)
    stop = stopped(error.brakes, witness.spans, told_ns, at_ns)
    checks |= {
        "exit code": error.exit_code == 5,
        f"cause: {error.cause}": error.cause == cause,
        f"phase: {error.phase}": phase is Phase.BRAKE or error.phase == phase.word,
        "one sentence": "\n" not in str(error),
        f"stop after {stop.found_ms} ms": phase is Phase.BRAKE or stop.found_ms * 1e6 <= PERIOD_NS,
        f"outcome: {error.outcome}": ("the arm was braked for 0.08 s with" in error.outcome)
        is (phase not in UNTESTED),
        f"drives disabled after {stop.off_ms:.1f} ms": stop.off_ms <= MOST_MS,
    }
    return [what for what, holds in checks.items() if not holds]


def endings(
    prepared: Prepared, config: Path, seed: int, only: list[str], master: int
) -> list[tuple[tuple[str, str, str], list[str]]]:
    """For each phase, kind and name of what the operator did: what of a good ending was missed."""
    simulation = load_simulation(config, seed)
    simulation.arm.plant.warm_up()
    witness, request = Witness(simulation.arm, simulation), StopRequest()
    random, passed = np.random.default_rng(seed), Counter()
    moments = {phase: random.integers(a, b, endpoint=True) for phase, (a, b) in MOMENTS.items()}
    with Branches() as cases, set_up(prepared, config, simulation, witness) as rig:
        phase, attack, at_ns, brakes = Phase.IDLE, next(attacks(Phase.IDLE)), 0, False

        def before_cycle() -> None:
            nonlocal phase, attack, at_ns, brakes
            now = rig.loop.phase
            passed[now] += 1
            if cases.is_case and not brakes:
                return
            if now is Phase.APPROACH and passed[now] == moments[now] and cases.branch("brake"):
                brakes = True
                os.kill(os.getpid(), signal.SIGINT)
            elif passed[now] == moments.get(now):
                for attack in (a for a in attacks(now) if not only or a.name in only):
                    termios.tcsetattr(sys.stdin, termios.TCSANOW, single_keys)
                    if cases.branch((now.word, attack.kind, attack.name)):
                        phase, brakes = now, False
                        at_ns = witness.spans[-1].until_ns
                        attack.act(master)
                        return

        rig.bus.before_cycle = before_cycle
        error: UserError | None = None
        with request.listening() as operator:
            single_keys = termios.tcgetattr(sys.stdin)  # which each case gives back as it ends
            rig.loop._operator = operator
            try:
                rig.run()
            except UserError as raised:
                error = raised
        witness.stay_alone()
        cases.end(cases.results if brakes else missed(rig, witness, error, phase, attack, at_ns))
        if error is not None:
            raise error
    brake = [case for name, found in cases.results if name == "brake" for case in found]
    return [case for case in cases.results if case[0] != "brake"] + brake


def main() -> int:
    """The table, and every case that missed something."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("protocol", choices=PROTOCOLS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=[])
    asked, good, all_of = parser.parse_args(), Counter(), Counter()
    master, terminal = pty.openpty()
    os.dup2(terminal, sys.stdin.fileno())
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), PROTOCOLS[asked.protocol].config)
        found = endings(prepare(config), config, asked.seed, asked.only, master)
        for (phase, kind, name), wrong in found:
            all_of[kind, phase] += 1
            good[kind, phase] += not wrong
            if wrong:
                print(f"{phase}, {name}: {wrong}", file=sys.stderr)
    words = [phase.word for phase in MOMENTS]
    print(f"| {asked.protocol} | {' | '.join(words)} |")
    print("| --- " * (len(words) + 1) + "|")
    for kind in dict.fromkeys(kind for kind, _ in all_of):
        cells = [f"{good[kind, w]} of {n}" if (n := all_of[kind, w]) else "" for w in words]
        print(f"| {kind} | {' | '.join(cells)} |")
    print(f"{sum(os.times()[:4]) / all_of.total():.2f} s of a core a case", file=sys.stderr)
    return int(good != all_of)


if __name__ == "__main__":
    sys.exit(main())
