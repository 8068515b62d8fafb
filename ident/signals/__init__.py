"""Arrays, and zero-phase filtering."""
