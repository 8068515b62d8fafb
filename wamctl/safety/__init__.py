"""Limits and fault detection that every cycle passes."""
