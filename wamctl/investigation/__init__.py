"""Rounds of experiment, identification and gap, until the verdict is final."""
