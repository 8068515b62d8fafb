"""Solving it: an augmented Lagrangian from many starts, on every core."""
