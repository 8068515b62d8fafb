"""A bus served by a thread of the tests' process."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from sim_bus.can_bus.hub import Hub
from sim_bus.server import Service, serve


@contextmanager
def served_by_thread(service: Service, hub: Hub) -> Iterator[None]:
    """A thread that serves until the block is left."""
    reading, writing = os.pipe()
    with os.fdopen(reading) as stop:
        thread = threading.Thread(target=serve, args=(service, hub, stop))
        thread.start()
        try:
            yield
        finally:
            os.close(writing)
            thread.join(10.0)
            hub.close()
            assert not thread.is_alive()
