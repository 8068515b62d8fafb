"""The Python interface: identification and the search for the gap on arrays or bags."""
