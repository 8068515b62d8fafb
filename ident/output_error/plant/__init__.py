"""The simulated arm in compiled form: servos, gears, and links."""
