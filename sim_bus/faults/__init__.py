"""Faults that the simulated bus can have, scripted from a file or drawn from a seed."""
