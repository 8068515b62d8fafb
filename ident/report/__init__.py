"""Reports: pages and figures drawn from results; nothing is computed here."""
