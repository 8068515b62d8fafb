"""One identification run, and how good it is."""
