"""The experiment: preflight, session, phases, and the loop."""
