"""A burst of torque that no other effect explains: set apart before effects are named."""

from dataclasses import replace

from ident.gap.contact import Burst, find_burst
from ident.gap.experiment import Experiment
from ident.gap.repeats import pairs
from ident.gap.search import Present, extend
from ident.gap.table import Nominal, tabulate
from ident.gap.way import Way

_BESIDE = 0.25  # of an effect's gain: what a burst beside it must bring


def cut_out(source: Experiment, way: Way, larger: Present, best: float) -> bool:
    """Set a burst apart that stands out from the model with the next effects; whether it was done.

    Without such effects it must explain more than any other; with them a good part of theirs: what
    they leave in a few places because their form is another one is no burst. Nor is what comes
    again with the motion.
    """
    if not way.may_cut or way.burst is not None:
        return False
    burst = _loud(way.rows, larger)
    beside = larger is not way.present
    least = max(_BESIDE * best if beside else best, way.threshold.of("contact"))
    if burst is None or burst.gain < least:
        return False
    table = tabulate(way.rows, larger.model, ())
    if burst.recurs(pairs(source, way.rows, table)):
        return False
    way.burst = burst
    way.rows = replace(way.rows, apart=burst.rows)
    way.present = extend(way.rows, way.present, ())
    return True


def stays(way: Way) -> bool:
    """Whether the burst still stands out from the model with all effects."""
    if way.burst is None:
        return False
    burst = _loud(replace(way.rows, apart=None), way.present)
    least = way.threshold.of("contact")
    return burst is not None and burst.gain >= least and bool((burst.rows & way.burst.rows).any())


def _loud(rows: Nominal, present: Present) -> Burst | None:
    table = tabulate(rows, present.model, present.accepted)
    return find_burst(rows, table, present.fit, present.fit.choice)
