"""The next motion of an investigation: rival answers as models, and what would tell them apart."""
