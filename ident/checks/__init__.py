"""Checks before the verdict: whether recordings and arm can be what they are taken for."""
