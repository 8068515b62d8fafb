"""The experiment: clock, loop, safety, logging and its phases."""
