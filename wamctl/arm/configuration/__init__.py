"""The sections of the arm's YAML file, and how they are read."""
