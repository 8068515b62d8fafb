"""Transients: short intervals with excess residual power, such as pushes and collisions."""
