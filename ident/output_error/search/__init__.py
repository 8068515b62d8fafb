"""The search by simulation: parts that recordings ask for, one after the other."""
