"""Zero-phase filtering."""
