"""Faults of the arm's description."""
