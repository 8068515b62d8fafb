"""Motion that makes the parameters visible."""
