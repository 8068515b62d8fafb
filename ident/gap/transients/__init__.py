"""Transients: short intervals with excess residual power."""
