"""What is not the arm, and changes while it is recorded: where it stands, what it carries."""
