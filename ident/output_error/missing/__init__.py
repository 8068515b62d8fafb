"""The search for the effect that a servo model lacks, from commanded and measured positions."""
