"""Classic Pucks and the safety module of a classic arm."""
