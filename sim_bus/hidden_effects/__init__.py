"""Effects that the simulated arm can hide, each in a form of its own."""
