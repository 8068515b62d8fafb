"""A fleet's reduced logs judged: types learned, arms tested, changes told."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ident.fleet.arm_type import ArmType
from ident.fleet.changes import least_log_odds
from ident.fleet.engine import LostError, Make, done
from ident.fleet.hierarchy import TypeStatistics, learned
from ident.fleet.series import ArmResult, Entry, Series, highest_odds, result
from ident.fleet.settings import FleetSettings
from ident.fleet.store import Store

T = TypeVar("T")

_ROUNDS = 4
"""Once with all arms, and then with types learned from those that have not changed."""

_SUREST = 0.5  # of the highest logarithm of the odds

Hear = Callable[[str, float], None]


@dataclass(frozen=True)
class Judged:
    """A fleet before its arms are written down one by one.

    Attributes:
        series: the arms, by name and type.
        least_odds: logarithm of the odds from which a change is told.
    """

    series: tuple[Series, ...]
    least_odds: float


def judge(
    store: Store,
    entries: Sequence[Entry],
    make: Make,
    waiting: int,
    settings: FleetSettings,
    hear: Hear,
) -> Judged:
    """Learn the types, and find the odds that a change must reach.

    Args:
        store: where the reductions are kept.
        entries: logs that can be used, sorted by arm and time.
        make: makes executors on this machine.
        waiting: most arms that are given out at a time.
        settings: of the fleet.
        hear: hears what is being done, and the share of it.
    """
    changed: set[tuple[str, str]] = set()
    judged = Judged((), np.inf)
    for _ in range(_ROUNDS):
        series = _series(store, entries, changed, settings, hear)
        highest = np.full(len(series), -np.inf)
        numbers = {id(s): k for k, s in enumerate(series)}
        for k, (one, odds) in enumerate(done(make, highest_odds, series, waiting)):
            highest[numbers[id(one)]] = -np.inf if isinstance(odds, LostError) else odds
            hear("testing arms", (k + 1) / len(series))
        least = least_log_odds(highest.tolist(), settings.false_alarm_share)
        judged = Judged(tuple(replace(s, least_odds=least) for s in series), least)
        told = {s.key: float(h) for s, h in zip(series, highest, strict=True) if h >= least}
        if told.keys() <= changed:
            break
        changed = (changed & told.keys()) | _surest({k: told[k] for k in told.keys() - changed})
    return judged


def _surest(told: Mapping[tuple[str, str], float]) -> set[tuple[str, str]]:
    """The surest of each type: one large change makes its sisters seem changed, where few teach.

    Args:
        told: logarithm of the odds of arms that seem to have changed, by the names of arm and type.
    """
    highest: dict[str, float] = defaultdict(float)
    for (_, kind), odds in told.items():
        highest[kind] = max(highest[kind], odds)
    return {key for key, odds in told.items() if odds >= _SUREST * highest[key[1]]}


def _series(
    store: Store,
    entries: Sequence[Entry],
    changed: Collection[tuple[str, str]],
    settings: FleetSettings,
    hear: Hear,
) -> list[Series]:
    """The arms in the order of their names, with what is known of their types.

    Types are learned from arms that have not changed, as far as it is known.
    """
    by_type: dict[str, dict[str, list[Entry]]] = defaultdict(lambda: defaultdict(list))
    for entry in entries:
        by_type[entry.stored.reduced.type][entry.arm].append(entry)
    series = []
    for number, (name, arms) in enumerate(sorted(by_type.items())):
        hear("learning what arms of a type share", number / len(by_type))
        kind = store.arm_type(name)
        steady = [logs for arm, logs in arms.items() if (arm, name) not in changed]
        known = _learned(kind, steady or list(arms.values()), settings)
        series += [Series(a, tuple(logs), kind, known, settings) for a, logs in arms.items()]
    return sorted(series, key=lambda s: s.key)


def _learned(
    kind: ArmType, arms: Sequence[Sequence[Entry]], settings: FleetSettings
) -> TypeStatistics:
    """Statistics of a type, from some arms and some logs of each, evenly chosen."""
    chosen = [even(logs, settings.type_logs) for logs in even(arms, settings.type_arms)]
    warm = [e.temperature_c for logs in chosen for e in logs if e.temperature_c is not None]
    reference = round(float(np.mean(warm)), 1) if warm else 25.0
    data = [[e.data(reference) for e in logs] for logs in chosen]
    return learned(data, kind, reference, settings.type_rounds)


def even(items: Sequence[T], most: int) -> list[T]:
    """At most so many of the items, evenly chosen."""
    places = np.unique(np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int))
    return [items[k] for k in places]


def results(
    judged: Judged, make: Make, waiting: int, hear: Hear
) -> Iterator[tuple[Series, ArmResult]]:
    """What is said of each arm, in the order of their names."""
    ready: dict[int, ArmResult] = {}
    numbers = {id(s): k for k, s in enumerate(judged.series)}
    following = 0
    for k, (one, found) in enumerate(done(make, result, judged.series, waiting)):
        hear("following each arm's parameters", (k + 1) / len(judged.series))
        if isinstance(found, LostError):
            raise found
        ready[numbers[id(one)]] = found
        while following in ready:
            yield judged.series[following], ready.pop(following)
            following += 1
