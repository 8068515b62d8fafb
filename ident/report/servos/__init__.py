"""Pages of identification by simulation."""
