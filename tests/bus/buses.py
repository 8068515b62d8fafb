"""On which buses a test runs: all on the embedded one, few on the kernel's, which is slow here.

The kernel's bus runs what could differ there: a whole experiment, errors of the controller, silence
and order of frames, set-up, and who else is on the bus. What follows from the frames' content alone
is the same on every bus.
"""

from collections.abc import Callable, Iterable
from typing import Any

import pytest

EMBEDDED = "simbus"
BUSES = (EMBEDDED, pytest.param("socketcan", marks=pytest.mark.vcan))


def on_embedded_bus(fixture: str) -> pytest.MarkDecorator:
    """The mark of a test that runs on the embedded bus only; `fixture` is that of the bus."""
    return pytest.mark.parametrize(fixture, [EMBEDDED], indirect=True)


def on_buses(
    fixture: str, names: tuple[str, ...], cases: Iterable[Any], of_kernel: Callable[[Any], bool]
) -> pytest.MarkDecorator:
    """The mark of a test whose cases run on the embedded bus, and some on the kernel's too.

    Args:
        fixture: name of the bus's fixture.
        names: of the arguments.
        cases: values of the arguments; where there is one argument, its value.
        of_kernel: whether a case runs on the kernel's bus.
    """
    rows = []
    for case in cases:
        values = case if isinstance(case, tuple) else (case,)
        name = values[0]["fault"] if isinstance(values[0], dict) else f"{values[0]:#05x}"
        rows.append(pytest.param(EMBEDDED, *values, id=f"simbus-{name}"))
        if of_kernel(case):
            rows.append(
                pytest.param("socketcan", *values, id=f"socketcan-{name}", marks=pytest.mark.vcan)
            )
    return pytest.mark.parametrize((fixture, *names), rows, indirect=[fixture])
