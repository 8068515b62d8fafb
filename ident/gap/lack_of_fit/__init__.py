"""Lack of fit: structure that remains, and the noise that repeats of a motion show."""
