"""Effects that the simulated arm can carry in secret: truths for tests that look for them."""
