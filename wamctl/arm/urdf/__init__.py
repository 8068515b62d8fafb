"""Checks of a URDF before Pinocchio reads it."""
