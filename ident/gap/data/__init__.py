"""The recordings of a search: segments, windows, noise regions, checks."""
