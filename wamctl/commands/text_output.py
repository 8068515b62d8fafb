"""Results as lines for the operator."""

import os
import sys

import typer

from wamctl.commands.bench import Bench
from wamctl.commands.check import Check
from wamctl.drives.interface import Counters
from wamctl.experiment.excite import Summary
from wamctl.investigation.investigate import Investigation
from wamctl.realtime.latency import Percentiles
from wamctl.realtime.scheduling import Privileges


def print_summary(summary: Summary) -> None:
    """What came of an experiment."""
    _line("log", str(summary.log))
    _line("cycles", f"{summary.rows} logged, {summary.counted} of them counted")
    _print_frames(summary.frames)
    if summary.speed is not None:
        _line("lockstep", f"{summary.speed:.1f} times as fast as real time")
        return
    _line("deadlines", f"{summary.timing.missed} missed")
    _print_percentiles("wake-up", summary.timing.latency())
    _print_percentiles("cycle", summary.timing.cycle())
    _print_privileges(summary.privileges)


def print_bench(measured: Bench) -> None:
    """How punctual the loop is."""
    _line("loop", f"{measured.cycles} cycles in {measured.seconds:g} s, drives disabled")
    _print_percentiles("wake-up", measured.latency)
    _print_percentiles("bare timer", measured.baseline)
    _line("ratio", f"{measured.ratio:.2f} at 99.9 % (timer: {measured.baseline_name})")
    _print_percentiles("cycle", measured.cycle)
    _line(
        "software",
        f"{measured.software_us:.0f} us of the cycle at 99 %, {measured.share:.0%} of the period "
        f"(the bus takes {measured.wire_us:.0f} us)",
    )
    _line("deadlines", f"{measured.missed} missed")
    _print_frames(measured.frames)
    _print_privileges(measured.privileges)


def print_check(found: Check) -> None:
    """What an examination found."""
    _line("arm", f"{found.arm}, {found.seconds:.1f} s of excitation")
    for use in found.uses:
        bound = f"{'at least' if use.quantity == 'distance' else 'limit'} {use.limit:.4g}"
        text = f"{use.share:.0%} of what is allowed: {use.value:.4g} {use.unit}, {bound}"
        _line(use.quantity, f"{text}; {use.subject}")
    _line(
        "bus",
        f"{found.load.nominal:.1%} without stuff bits, {found.load.worst:.1%} with the most; "
        f"{found.load.cycle_us:.0f} us of each cycle",
    )
    _line("drives", ", ".join(found.drives) or "not asked (give --bus)")
    asked = "" if found.drives else "; the drives are still to be asked"
    _line("verdict", f"may run: every limit is kept{asked}")
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)


def print_investigation(found: Investigation) -> None:
    """How an investigation has ended."""
    for sentence in found.sentences:
        typer.echo(sentence)


def say(sentence: str) -> None:
    """A sentence for the operator on standard error, even where the terminal was closed.

    Control characters, such as those of a name out of a file, are shown and not obeyed.
    """
    try:
        typer.echo(printable(sentence), err=True)
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)  # so that nothing fails again at the end
        os.dup2(nowhere, sys.stderr.fileno())
        os.close(nowhere)


def printable(text: str) -> str:
    """The text with every control character but line ends in Python's notation."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def _line(name: str, text: str) -> None:
    typer.echo(f"{name:14} {text}")


def _print_percentiles(name: str, us: Percentiles) -> None:
    shown = (f"{us.p50:.0f} us half", f"{us.p99:.0f} us 99 %", f"{us.p99_9:.0f} us 99.9 %")
    _line(name, f"{', '.join(shown)}, {us.most:.0f} us most")


def _print_frames(frames: Counters) -> None:
    _line(
        "frames",
        f"{frames.lost} lost, {frames.late} late, {frames.doubled} doubled, "
        f"{frames.reordered} reordered, {frames.malformed} malformed, {frames.foreign} foreign",
    )


def _print_privileges(privileges: Privileges) -> None:
    memory = "locked" if privileges.memory_locked else "not locked"
    _line("system", f"{privileges.scheduling} scheduling, memory {memory}")
    for line in privileges.advice:
        typer.echo(f"for {line}", err=True)
