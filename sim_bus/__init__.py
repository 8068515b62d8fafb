"""Simulated drives and arm on the far side of the wire."""
