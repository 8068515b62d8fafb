"""Closed-loop forward simulation of an identified arm."""
