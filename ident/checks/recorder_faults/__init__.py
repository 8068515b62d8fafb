"""Faults of a recorder: single samples that are wrong, and torque of another instant."""
