"""Work in several processes."""

import math
from multiprocessing import active_children

import pytest

from ident.processes import in_processes


def test_results_come_in_the_order_of_the_items():
    assert list(in_processes(math.sqrt, [9.0, 4.0, 1.0], 2)) == [3.0, 2.0, 1.0]


def test_an_error_comes_through_and_leaves_no_process():
    before = set(active_children())
    with pytest.raises(ValueError, match="math domain"):
        list(in_processes(math.sqrt, [4.0, -1.0], 2))
    assert set(active_children()) == before
